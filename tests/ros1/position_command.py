"""The definitions of PositionCommand that are in use, with their md5 sums."""

POSITION_TAIL = """
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
POSITION_START = """Header header
geometry_msgs/Point position
geometry_msgs/Vector3 velocity
geometry_msgs/Vector3 acceleration
"""
SHORT = (
    """uint8 TRAJECTORY_STATUS_EMPTY = 0
uint8 TRAJECTORY_STATUS_READY = 1
uint8 TRAJECTORY_STATUS_COMPLETED = 3
uint8 TRAJECTROY_STATUS_ABORT = 4
uint8 TRAJECTORY_STATUS_ILLEGAL_START = 5
uint8 TRAJECTORY_STATUS_ILLEGAL_FINAL = 6
uint8 TRAJECTORY_STATUS_IMPOSSIBLE = 7
"""
    + POSITION_START
    + """float64 yaw
float64 yaw_dot
float64[3] kx
float64[3] kv
uint32 trajectory_id
uint8 trajectory_flag"""
    + POSITION_TAIL
)
LONG = (
    """uint8 TRAJECTORY_STATUS_EMPTY = 0
uint8 TRAJECTORY_STATUS_EMER = 2
uint8 TRAJECTORY_STATUS_READY = 1
uint8 TRAJECTORY_STATUS_COMPLETED = 3
uint8 TRAJECTROY_STATUS_ABORT = 4
uint8 TRAJECTORY_STATUS_ILLEGAL_START = 5
uint8 TRAJECTORY_STATUS_ILLEGAL_FINAL = 6
uint8 TRAJECTORY_STATUS_IMPOSSIBLE = 7
uint32 ACTION_STOP = 8
"""
    + POSITION_START
    + """geometry_msgs/Vector3 jerk
geometry_msgs/Vector3 angular_velocity
geometry_msgs/Vector3 attitude
geometry_msgs/Vector3 thrust
float64 yaw
float64 yaw_dot
float64 vel_norm
float64 acc_norm
float64[3] kx
float64[3] kv
uint32 trajectory_id
uint8 trajectory_flag"""
    + POSITION_TAIL
)
OLDEST = POSITION_START + "float64 yaw\nfloat64 yaw_dot\nfloat64[3] kx\nfloat64[3] kv" + POSITION_TAIL
OWN = POSITION_START + "float64 yaw\nfloat64[] gains\nstring who" + POSITION_TAIL
VARIANTS = {
    "long": (LONG, "d008e86de36e11deb1e4033ac2c394a9"),
    "short": (SHORT, "4712f0609ca29a79af79a35ca3e3967a"),
    "oldest": (OLDEST, "835935bcd6f18632d9e26a3093237902"),
    "own": (OWN, None),
}
