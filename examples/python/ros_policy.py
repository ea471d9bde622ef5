"""Flies a policy of train.py on ROS 1: odometry and points in, velocities out; on a real vehicle or beside

    pointflight fly forest.pfmap --ros1 --lidar vlp16 --start 8,10,2
    python3 ros_policy.py policy.npz drone0 vlp16 X,Y,Z"""
import sys
import types

import numpy as np
import rospy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2

from pointflight.gym import Observer, Policy

if len(sys.argv) < 5:
    sys.exit(__doc__)
policy, drone, lidar = Policy.load(sys.argv[1]), sys.argv[2], sys.argv[3]
goal = np.array([float(word) for word in sys.argv[4].split(",")])
observer, body = Observer(goal, policy.lidar), types.SimpleNamespace(stamp=None)
mount = np.array([0.0, 0.0, 0.1])  # of the sensor on the body, m


def on_odometry(message: Odometry) -> None:
    p, q, v, w = (message.pose.pose.position, message.pose.pose.orientation, message.twist.twist.linear,
                  message.twist.twist.angular)  # fmt: skip
    body.position, body.orientation = np.array([p.x, p.y, p.z]), np.array([q.x, q.y, q.z, q.w])
    axis, angle = body.orientation[:3], body.orientation[3]
    ahead = np.array([v.x, v.y, v.z])  # in the body frame; turned into the world's
    turned = 2.0 * np.cross(axis, ahead)
    body.velocity = ahead + angle * turned + np.cross(axis, turned)
    body.angular_velocity, body.stamp = np.array([w.x, w.y, w.z]), message.header.stamp


def on_points(message: PointCloud2) -> None:
    if body.stamp is None:
        return
    kinds = {7: "<f4", 8: "<f8", 6: "<u4", 4: "<u2", 2: "u1"}
    rows = np.frombuffer(message.data, np.dtype({
        "names": [f.name for f in message.fields], "formats": [kinds[f.datatype] for f in message.fields],
        "offsets": [f.offset for f in message.fields], "itemsize": message.point_step}))  # fmt: skip
    points = np.stack([rows["x"], rows["y"], rows["z"]], 1) + mount
    times = 1e-9 * rows["timestamp"]  # Livox' driver: ns; Velodyne's has `time`, s after the stamp
    ages = body.stamp.to_sec() - times
    observer.elapsed = (body.stamp - began.setdefault("stamp", body.stamp)).to_sec()
    action = policy(observer.of_points(body, points, ages))[0] * (np.linalg.norm(goal - body.position) > 1.0)
    observer.last_action = action
    told = TwistStamped()
    told.header.frame_id, told.header.stamp = f"{drone}/base_link", body.stamp
    told.twist.linear.x, told.twist.linear.y, told.twist.linear.z = 3.0 * action[:3]
    told.twist.angular.z = action[3]
    out.publish(told)


rospy.init_node("policy")
began, out = {}, rospy.Publisher(f"/{drone}/cmd/velocity", TwistStamped, queue_size=1)
rospy.Subscriber(f"/{drone}/odom", Odometry, on_odometry, queue_size=1, tcp_nodelay=True)
rospy.Subscriber(f"/{drone}/{lidar}/points", PointCloud2, on_points, queue_size=1, buff_size=1 << 24)
rospy.spin()
