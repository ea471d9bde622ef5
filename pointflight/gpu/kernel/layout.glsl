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
};

/// What it hit: `KernelHit`, or kTooMany.
struct DeviceHit {
  float range;
  float cosine;
  uint surfel;
};

const int kMostHits = 32;      // in one ray's list
const int kMostEntries = 64;   // in its stack
const float kNothing = -1.0f;  // range of a ray that hits nothing
const float kTooMany = -2.0f;  // more than there is room for: for the processor
const float kNever = 3.0e38f;
const uint kInner = 0u;  // what comes next on a ray's way: a node,
const uint kDone = 15u;  // nothing; else so many surfels of a leaf
const uint kNowhere = 0xffffffffu;
