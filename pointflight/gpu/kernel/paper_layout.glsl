// What host and device share of the paper's images. GLSL and C++: all members are four bytes wide.

/// An image over the rays of a scan: `PaperImage`, and where the sensor is.
struct PaperNumbers {
  uint rows;
  uint columns;
  uint is_full_turn;
  uint is_narrow;
  float step;
  float column_step;
  float azimuth_min;
  float elevation_min;
  float range_max;
  float sin_low;
  float sin_high;
  float left_x;
  float left_y;
  float right_x;
  float right_y;
  float turn[9];  // rows, into the sensor's frame
};

/// A point of a voxel, from its corner.
struct PaperPoint {
  float x;
  float y;
  float z;
  float radius;  // of its cube, m; negative: its plane counts
  float normal_x;
  float normal_y;
  float normal_z;
  float intensity;
};

/// Up to kChunk points of one voxel that go together.
struct PaperChunk {
  uint first;
  uint count;
  float corner_x;  // of the voxel, in the sensor's frame
  float corner_y;
  float corner_z;
};
const uint kChunk = 128u;

/// What a dispatch does.
struct PaperCall {
  uint task;
  uint chunks;
};
const uint kDrawDepths = 0u;   // the nearest depth of each pixel by points of few pixels,
const uint kDrawLarge = 1u;    // by points of many, a group each
const uint kClaim = 2u;        // whose depth it is: the first of them
const uint kClaimLarge = 3u;
const uint kResolve = 4u;      // what pixels hold

const uint kFewPixels = 256u;
const uint kLargeGroups = 512u;
