// What host and device share. GLSL and C++: all members are four bytes wide.

/// Numbers of a map that every ray needs.
struct MapNumbers {
  float r;                 // resolution, m
  float r_squared;
  float position_step;     // of surfels' positions, m
  float support_squared;   // M^2
  float inverse_support;   // 1 / M^2
  float weight_scale;      // weight of a hit in the middle
  float window;            // m
  float shares_per_metre;  // of the window
  float widest2;           // s0^2 of the thickness classes 2 and 3, m^2
  float widest3;
  int tau;
  uint node_count;
  float inverse_thickness[4];
  float thickness[4];
  float inverse_ratio[8];
  float inverse_spread[32];  // 1 / s2 of each code
  // what wide beams want besides
  float ratio[8];
  float support;                // M
  float cone_radius;            // of beams, sigmas
  float solid_support;          // of it, what counts as the surfel between sub-rays
  float leaf_reach;             // M and a little
  float soft_scale;             // weights of sub-rays
  float soft_tau;               // of them
  float depth_steps_per_metre;  // of the window
  float metres_per_depth_step;
  uint has_intensity;
  // of a map in several buffers: 2^shift items in each
  uint node_shift;  // uvec4
  uint word_shift;  // uvec2
};

/// A ray from a voxel of the map's grid and the rest, m (`GridOrigin`).
struct DeviceRay {
  int voxel_x;
  int voxel_y;
  int voxel_z;
  float rest_x;
  float rest_y;
  float rest_z;
  float x;  // direction
  float y;
  float z;
  float range_max;
};

/// A beam in the frame of its sensor: `SensorBeam`.
struct DeviceBeam {
  float direction_x;
  float direction_y;
  float direction_z;
  float origin_x;
  float origin_y;
  float origin_z;
  float across_x;
  float across_y;
  float stretch;
  float fraction;
  uint piece;
  uint number;
};

/// All beams of a sensor at a time: `AimedBeams`, from a voxel and the rest. Its poses (`BeamPose`)
/// and deviations (`BeamDeviation`) lie at words of the same buffer.
struct DeviceAim {
  int voxel_x;
  int voxel_y;
  int voxel_z;
  float rest_x;
  float rest_y;
  float rest_z;
  float range_max;
  uint poses;
  uint is_rolling;  // a pose at each end of a piece, else one
  uint deviations;  // kNowhere: none
};
const uint kAimWords = 10u;
const uint kPoseWords = 7u;

/// What a call asks for.
struct DeviceCall {
  uint count;         // rays
  uint beams;         // of each aim; 0: rays are given
  uint has_origins;   // not all beams leave from the sensor's origin
  uint wants_ranges;  // and no more of each hit
  // of wide beams
  uint threads;          // invocations
  uint first;            // beams of this dispatch: from here
  uint until;            // to here
  uint most_more;        // beams whose second level there is room for
  float sigma_across;    // rad
  float sigma_up;        // rad
  float per_intensity;   // `Reflectances`
  float same;
  float least;
};

/// What it hit: `KernelHit`, or kTooMany.
struct DeviceHit {
  float range;
  float cosine;
  uint surfel;
};

/// What came of a wide beam.
struct WideResult {
  uint kind;
  float range;  // of one echo: `Echo`
  float reflectivity;
  float intensity;
  float depth;
  float cosine;
  uint surfel;   // of kMoreSubRays: which 32 hits
  uint sub_ray;  // of kMoreSubRays: 1: a surfel lies before what they hit; and twice the direction
};
const uint kNoEcho = 0u;
const uint kOneEchoOfAll = 1u;    // all of the beam hit it
const uint kMoreSubRays = 2u;     // 32 hits of the second level
const uint kLeftToProcessor = 3u;

const int kMostTouched = 96;        // surfels in the list of a wide beam
const uint kTouchedNumbers = 13u;
const int kMostRows = 64;           // of a sub-ray
const uint kSecondLevel = 32u;      // sub-rays

// tables of wide beams, by words
const uint kAtTurns = 0u;      // cosine and sine of 64
const uint kAtEight = 128u;    // x and y of the first level
const uint kAtShares = 144u;   // of the light
const uint kAtPerXx = 152u;    // 1 / sum of x^2
const uint kAtStrips = 153u;   // eight directions
const uint kAtSecond = 169u;   // x and y of 32, for each of these
const uint kAtLevels = 681u;   // intensity of each code
const uint kAtUsual = 937u;    // 4096 reflectivities
const uint kTableWords = 5033u;

const int kMostHits = 32;      // in one ray's list
const int kMostEntries = 64;   // in its stack
const float kNothing = -1.0f;  // range of a ray that hits nothing
const float kTooMany = -2.0f;  // more than there is room for: for the processor
const float kNever = 3.0e38f;
const uint kInner = 0u;  // what comes next on a ray's way: a node,
const uint kDone = 15u;  // nothing; else so many surfels of a leaf
const uint kNowhere = 0xffffffffu;
