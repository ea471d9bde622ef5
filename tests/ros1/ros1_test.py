#!/usr/bin/python3
"""pointflight against a real rosmaster, rospy and rosbag: what others see and what they can do.

ros1_test.py PROGRAM [unittest arguments]
"""

import os
import resource
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = sys.argv.pop(1)
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from position_command import VARIANTS  # noqa: E402

try:
    import rosbag  # noqa: F401
    import rosgraph
    import rospy
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def wait_for(condition, seconds=20.0, what="something"):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        result = condition()
        if result:
            return result
        time.sleep(0.02)
    raise AssertionError(f"waited {seconds} s for {what}")


class Ros1Test(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        port = free_port()
        os.environ.update(
            ROS_MASTER_URI=f"http://127.0.0.1:{port}",
            ROS_IP="127.0.0.1",
            ROS_HOME=cls.folder.name + "/ros",
        )
        cls.master = subprocess.Popen(
            ["/usr/bin/rosmaster", "--core", "-p", str(port)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        wait_for(rosgraph.is_master_online, what="the master")
        rospy.init_node("peer", disable_signals=True)
        cls.map = cls.folder.name + "/forest.pfmap"
        run = lambda *a: subprocess.run([PROGRAM, *a], check=True, capture_output=True)
        run("map", "forest", "--size-x", "16", "--size-y", "16", "--density", "300", "--trees",
            "300", "-o", cls.folder.name + "/f.pcd")
        run("map", "import", cls.folder.name + "/f.pcd", "-o", cls.map, "--resolution", "0.1")

    @classmethod
    def tearDownClass(cls):
        rospy.signal_shutdown("done")
        cls.master.kill()
        cls.master.wait()
        cls.folder.cleanup()

    def fly(self, *flags, scenario=None, environment=None):
        """Starts a flight; it is ended after the test. stderr is kept."""
        self.flights = getattr(self, "flights", 0) + 1
        self.log = open(f"{self.folder.name}/fly.{self.flights}.log", "w+")
        process = subprocess.Popen(
            [PROGRAM, "fly", scenario or self.map, "--ros1", *flags],
            stdout=self.log,
            stderr=self.log,
            env={**os.environ, **(environment or {})},
        )
        self.addCleanup(self.stop, process, self.log)
        return process

    @staticmethod
    def stop(process, log):
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.wait(timeout=20)
        log.close()

    def _callTestMethod(self, method):
        try:
            method()
        except BaseException:
            if hasattr(self, "log"):
                print("the flight said:\n" + open(self.log.name).read(), file=sys.stderr)
            raise

    def collect(self, topic, kind, count, seconds=30.0):
        got = []
        subscriber = rospy.Subscriber(topic, kind, got.append, queue_size=1000)
        try:
            wait_for(lambda: len(got) >= count, seconds, f"{count} messages on {topic}")
        finally:
            subscriber.unregister()
        return got[:count]

    # -- out ---------------------------------------------------------------------------------

    def test_rates_and_contents(self):
        from nav_msgs.msg import Odometry
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import Imu, PointCloud2
        import sensor_msgs.point_cloud2 as pc2

        self.fly()
        kinds = {"/clock": Clock, "/drone0/odom": Odometry, "/drone0/imu": Imu,
                 "/drone0/mid360/points": PointCloud2}
        kept = {topic: [] for topic in kinds}
        for topic, kind in kinds.items():
            self.addCleanup(rospy.Subscriber(topic, kind, kept[topic].append, queue_size=1000).unregister)
        wait_for(lambda: len(kept["/drone0/mid360/points"]) >= 41, 60, "41 scans")
        expected = {"/clock": 100, "/drone0/odom": 200, "/drone0/imu": 200,
                    "/drone0/mid360/points": 10}
        for topic, hertz in expected.items():
            stamps = [
                (m.clock if topic == "/clock" else m.header.stamp).to_nsec() for m in kept[topic]
            ]
            # in order, on the grid of the rate; how many a busy machine loses is no matter of a test
            periods = [(b - a) * 1e-9 * hertz for a, b in zip(stamps, stamps[1:])]
            self.assertGreater(min(periods), 0.5, topic)
            for period in periods:
                self.assertAlmostEqual(period, round(period), delta=0.11, msg=topic)
        # the mean: rotors shake each sample
        up = [m.linear_acceleration.z for m in kept["/drone0/imu"]]
        self.assertAlmostEqual(sum(up) / len(up), 9.81, delta=0.3)
        odometry = kept["/drone0/odom"][-1]
        self.assertEqual(odometry.child_frame_id, "drone0/base_link")
        cloud = kept["/drone0/mid360/points"][-1]
        self.assertEqual(cloud.header.frame_id, "drone0/mid360")
        points = list(pc2.read_points(cloud, ("x", "y", "z", "tag", "line", "timestamp")))
        self.assertEqual(len(points), cloud.width)
        times = [p[5] for p in points]
        self.assertEqual(times, sorted(times))
        self.assertAlmostEqual(times[0] * 1e-9, cloud.header.stamp.to_sec(), delta=1e-6)
        self.assertLess(times[-1] - times[0], 1e8)
        self.assertEqual({p[3] for p in points}, {16})

    def test_livox_custom_messages(self):
        """As a subscriber with Livox' definition gets them: type, md5 and bytes."""
        self.fly("--profile", "livox")
        message = self.collect("/livox/lidar", rospy.AnyMsg, 2)[-1]
        self.assertEqual(message._connection_header["type"], "livox_ros_driver2/CustomMsg")
        self.assertEqual(message._connection_header["md5sum"], "e4d6829bdfe657cb6c21a746c86b21a6")
        data = message._buff
        seq, sec, nsec, length = struct.unpack_from("<IIII", data, 0)
        at = 16 + length
        self.assertEqual(data[16:at], b"livox_frame")
        timebase, number, lidar = struct.unpack_from("<QIB", data, at)
        at += 8 + 4 + 1 + 3
        (count,) = struct.unpack_from("<I", data, at)
        at += 4
        self.assertEqual(number, count)
        self.assertEqual(timebase, sec * 10**9 + nsec)
        self.assertGreater(sec, time.time() - 3600)  # this profile lives on the wall clock
        self.assertEqual(len(data), at + 19 * count)
        offset, x, y, z, reflectivity, tag, line = struct.unpack_from("<IfffBBB", data, at)
        self.assertEqual(offset, 0)
        self.assertEqual(tag, 16)
        self.assertLess(line, 4)
        from sensor_msgs.msg import Imu

        self.assertEqual(self.collect("/livox/imu", Imu, 1)[0].header.frame_id, "livox_frame")

    def test_whoever_comes_late_gets_the_map_and_the_transforms(self):
        from sensor_msgs.msg import PointCloud2
        from tf2_msgs.msg import TFMessage

        self.fly()
        self.collect("/clock", rospy.AnyMsg, 100)
        cloud = self.collect("/map", PointCloud2, 1)[0]
        self.assertGreater(cloud.width, 1000)
        self.assertEqual(cloud.header.frame_id, "world")
        fixed = self.collect("/tf_static", TFMessage, 1)[0]
        self.assertEqual(fixed.transforms[0].child_frame_id, "drone0/mid360")

    def test_marsims_graph(self):
        """Topics and types as `rostopic list` shows them, and the frames in the messages."""
        self.fly("--profile", "marsim")
        self.collect("/quad_0/lidar_slam/odom", rospy.AnyMsg, 1)
        master = rosgraph.Master("/peer")
        types = dict(master.getTopicTypes())
        published = dict(master.getPublishedTopics(""))
        quad = "/quad0_pcl_render_node/"
        shown = "/quad0_odom_visualization/"
        expected = {
            "/quad_0/lidar_slam/odom": "nav_msgs/Odometry",
            "/quad_0/imu": "sensor_msgs/Imu",
            "/quad_0/cmdRPM": "std_msgs/Float32MultiArray",
            "/quad_0/planning/pos_cmd": "quadrotor_msgs/PositionCommand",
            "/goal": "geometry_msgs/PoseStamped",
            quad + "cloud": "sensor_msgs/PointCloud2",
            quad + "sensor_cloud": "sensor_msgs/PointCloud2",
            quad + "sensor_pose": "geometry_msgs/PoseStamped",
            quad + "depth_img": "sensor_msgs/Image",
            quad + "dyn_cloud": "sensor_msgs/PointCloud2",
            quad + "uav_cloud": "sensor_msgs/PointCloud2",
            quad + "collision_cloud": "sensor_msgs/PointCloud2",
            quad + "simulator_compute_time": "geometry_msgs/PoseStamped",
            "/map_generator/global_cloud": "sensor_msgs/PointCloud2",
            "/tf": "tf2_msgs/TFMessage",
            shown + "pose": "geometry_msgs/PoseStamped",
            shown + "path": "nav_msgs/Path",
            shown + "velocity": "visualization_msgs/Marker",
            shown + "covariance": "visualization_msgs/Marker",
            shown + "covariance_velocity": "visualization_msgs/Marker",
            shown + "trajectory": "visualization_msgs/Marker",
            shown + "sensor": "visualization_msgs/Marker",
            shown + "robot": "visualization_msgs/Marker",
            shown + "drone_id": "visualization_msgs/Marker",
        }
        self.assertEqual({t: types.get(t) for t in expected}, expected)
        self.assertNotIn("/clock", published)
        from roslib.message import get_message_class
        from sensor_msgs.msg import Image, PointCloud2

        # md5 sums against the message classes of others, frames and rates
        frames = {topic: "world" for topic in expected if topic.startswith(shown)}
        frames.update({
            "/quad_0/lidar_slam/odom": "world",
            "/quad_0/imu": "quad_0",
            quad + "cloud": "world",
            quad + "sensor_cloud": "sensor",
            quad + "sensor_pose": "map",
            quad + "depth_img": "sensor",
            quad + "collision_cloud": "world",
            quad + "simulator_compute_time": "",
        })
        hertz = {topic: 10 if topic.startswith(quad) or topic == "/tf" else 200 for topic in frames}
        hertz.update({"/quad_0/cmdRPM": 200, "/tf": 10, quad + "collision_cloud": 200})
        got = {topic: [] for topic in hertz}
        subscribers = [rospy.Subscriber(t, rospy.AnyMsg, got[t].append, queue_size=10000) for t in got]
        wait_for(lambda: all(got.values()), 20, "every topic")
        for messages in got.values():
            messages.clear()
        wait_for(lambda: all(len(m) >= min(20, hertz[t]) for t, m in got.items()), 60, "messages")
        time.sleep(1.0)
        # the time of the run: header.stamp lies behind the sequence number
        stamps = [seconds + 1e-9 * nanoseconds for seconds, nanoseconds in
                  (struct.unpack("<II", m._buff[4:12]) for m in got["/quad_0/lidar_slam/odom"])]
        took = stamps[-1] - stamps[0]
        counts = {topic: len(messages) for topic, messages in got.items()}
        for subscriber in subscribers:
            subscriber.unregister()
        for topic, messages in got.items():
            # what a busy machine loses is no matter of a test
            self.assertLessEqual(counts[topic], 1.05 * hertz[topic] * took + 3, topic)
            kind = get_message_class(expected[topic])
            self.assertEqual(messages[0]._connection_header["md5sum"], kind._md5sum, topic)
            message = kind().deserialize(messages[0]._buff)
            if topic in frames:
                self.assertEqual(message.header.frame_id, frames[topic], topic)
            elif topic == "/tf":
                transform = message.transforms[0]
                self.assertEqual((transform.header.frame_id, transform.child_frame_id),
                                 ("world", "sensor"))
        cloud = self.collect(quad + "sensor_cloud", PointCloud2, 1)[0]
        self.assertEqual(cloud.header.frame_id, "sensor")
        fields = [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields]
        self.assertEqual(
            fields, [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("intensity", 16, 7, 1)]
        )
        self.assertEqual(cloud.point_step, 32)
        from geometry_msgs.msg import PoseStamped

        took = self.collect(quad + "simulator_compute_time", PoseStamped, 1)[0].pose.position.x
        self.assertGreater(took, 0.0)
        image = self.collect(quad + "depth_img", Image, 1)[0]
        self.assertEqual(image.encoding, "32FC1")
        self.assertGreater(cloud.header.stamp.to_sec(), time.time() - 3600)

    # -- in ----------------------------------------------------------------------------------

    def test_every_position_command_flies_the_vehicle(self):
        from nav_msgs.msg import Odometry
        import genpy.dynamic

        self.fly()
        here = self.collect("/drone0/odom", Odometry, 1)[0].pose.pose.position
        for number, (name, (definition, md5)) in enumerate(VARIANTS.items()):
            classes = genpy.dynamic.generate_dynamic("quadrotor_msgs/PositionCommand", definition)
            kind = classes["quadrotor_msgs/PositionCommand"]
            if md5:
                self.assertEqual(kind._md5sum, md5, name)
            publisher = rospy.Publisher("/drone0/cmd/position", kind, queue_size=10)
            target = here.z + 0.3 * (1 + number % 2)
            try:
                wait_for(publisher.get_num_connections, what=f"a subscriber of {name}")
                latest = []
                subscriber = rospy.Subscriber("/drone0/odom", Odometry, latest.append, queue_size=1)
                message = kind()
                message.position.x, message.position.y = here.x, here.y
                message.position.z = target
                message.yaw = 0.3 * number

                def arrived():
                    publisher.publish(message)
                    if not latest:
                        return False
                    pose = latest[-1].pose.pose
                    heading = 2.0 * pose.orientation.z
                    return (abs(pose.position.z - target) < 0.05
                            and abs(heading - 0.3 * number) < 0.1)

                wait_for(arrived, 15, f"the vehicle to follow {name}")
            finally:
                subscriber.unregister()
                publisher.unregister()

    def test_goals_velocities_attitudes_and_rotors(self):
        from geometry_msgs.msg import PoseStamped, TwistStamped
        from nav_msgs.msg import Odometry
        from std_msgs.msg import Float32MultiArray

        self.fly()
        here = self.collect("/drone0/odom", Odometry, 1)[0].pose.pose.position
        latest = []
        self.addCleanup(
            rospy.Subscriber("/drone0/odom", Odometry, latest.append, queue_size=1).unregister
        )

        def publish_until(topic, message, condition, what, once=False):
            publisher = rospy.Publisher(topic, type(message), queue_size=10)
            wait_for(publisher.get_num_connections, what=topic)
            if once:
                publisher.publish(message)

            def again():
                if not once:
                    publisher.publish(message)
                return latest and condition(latest[-1])

            wait_for(again, 20, what)
            publisher.unregister()

        goal = PoseStamped()
        goal.header.frame_id = "world"
        goal.pose.position.x, goal.pose.position.y = here.x + 0.3, here.y
        goal.pose.orientation.w = 1.0
        publish_until("/drone0/goal", goal,
                      lambda o: abs(o.pose.pose.position.x - here.x - 0.3) < 0.03
                      and abs(o.pose.pose.position.z - here.z) < 0.05, "the goal", once=True)
        climb = TwistStamped()
        climb.header.frame_id = "world"
        climb.twist.linear.z = 0.5
        publish_until("/drone0/cmd/velocity", climb,
                      lambda o: o.pose.pose.position.z > here.z + 0.5, "a climb")
        rotors = Float32MultiArray(data=[0.0] * 4)
        publish_until("/drone0/cmd/rotors", rotors,
                      lambda o: o.twist.twist.linear.z < -0.5, "rotors off")

    def test_malformed_and_useless_commands_are_left_out(self):
        from geometry_msgs.msg import PoseStamped, TwistStamped
        from nav_msgs.msg import Odometry
        from std_msgs.msg import String

        process = self.fly()
        before = self.collect("/drone0/odom", Odometry, 1)[0].pose.pose.position
        wrong = rospy.Publisher("/drone0/goal", String, queue_size=10)  # a wrong type
        nan = rospy.Publisher("/drone0/cmd/velocity", TwistStamped, queue_size=10)
        wait_for(wrong.get_num_connections, what="the goal's subscriber")
        wait_for(nan.get_num_connections, what="the velocity's subscriber")
        message = TwistStamped()
        message.twist.linear.x = float("nan")
        for _ in range(20):
            wrong.publish(String("to the left, please"))
            nan.publish(message)
            time.sleep(0.01)
        wrong.unregister()
        nan.unregister()
        time.sleep(0.3)
        after = self.collect("/drone0/odom", Odometry, 1)[0].pose.pose.position
        self.assertLess(abs(after.x - before.x) + abs(after.z - before.z), 0.05)
        self.assertIsNone(process.poll())
        text = self.stop_and_read(process)
        self.assertIn("that is no geometry_msgs/PoseStamped", text)
        self.assertIn("20 messages were left out; the last: /drone0/goal", text)
        self.assertIn("not finite", text)
        self.assertIn("20 rejected", text)

    def stop_and_read(self, process):
        process.send_signal(signal.SIGINT)
        process.wait(timeout=20)
        self.log.seek(0)
        return self.log.read()

    def test_pause_step_and_reset(self):
        from rosgraph_msgs.msg import Clock
        from std_msgs.msg import Bool, Empty

        process = self.fly()
        clocks = []
        self.addCleanup(rospy.Subscriber("/clock", Clock, clocks.append, queue_size=1).unregister)
        pause = rospy.Publisher("/pointflight/pause", Bool, queue_size=10)
        step = rospy.Publisher("/pointflight/step", Empty, queue_size=10)
        reset = rospy.Publisher("/pointflight/reset", Empty, queue_size=10)
        for publisher in (pause, step, reset):
            wait_for(publisher.get_num_connections, what=publisher.name)
            self.addCleanup(publisher.unregister)
        now = lambda: clocks[-1].clock.to_nsec()
        wait_for(lambda: len(clocks) > 100, what="the clock")
        pause.publish(True)
        time.sleep(0.5)
        still, count = now(), len(clocks)
        time.sleep(0.5)
        self.assertEqual(now(), still)
        self.assertGreater(len(clocks), count)  # goes on with the same time
        step.publish()
        wait_for(lambda: now() > still, what="a step")
        time.sleep(0.5)
        stepped = now()
        self.assertLess(stepped - still, 0.15e9)  # to the next scan
        pause.publish(False)
        wait_for(lambda: now() > stepped + 1e8, what="going on")
        reset.publish()
        wait_for(lambda: "reset" in open(self.log.name).read(), what="the reset")
        time.sleep(0.5)
        times = [c.clock.to_nsec() for c in clocks]
        self.assertEqual(times, sorted(times))  # no jump back
        self.assertIsNone(process.poll())

    def test_a_subscriber_that_is_too_slow_is_said(self):
        """A peer that takes nothing from its socket for a while."""
        from xmlrpc.client import ServerProxy

        process = self.fly()
        self.collect("/drone0/mid360/points", rospy.AnyMsg, 1)
        uri = rosgraph.Master("/peer").lookupNode("/pointflight")
        code, _, where = ServerProxy(uri).requestTopic(
            "/deaf", "/drone0/mid360/points", [["TCPROS"]])
        self.assertEqual(code, 1)
        fields = ["callerid=/deaf", "topic=/drone0/mid360/points", "type=*", "md5sum=*"]
        header = b"".join(struct.pack("<I", len(f)) + f.encode() for f in fields)
        with socket.socket() as deaf:
            deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            deaf.connect((where[1], where[2]))
            deaf.sendall(struct.pack("<I", len(header)) + header)
            wait_for(lambda: "loses messages" in open(self.log.name).read(), 40, "the warning")
            # others get theirs, in order
            stamps = [m.header.stamp.to_sec() for m in self.collect_clouds(15)]
            self.assertEqual(stamps, sorted(set(stamps)))
        text = self.stop_and_read(process)
        self.assertIn("a subscriber of /drone0/mid360/points is too slow", text)
        self.assertIn("messages were dropped for slow subscribers", text)

    def collect_clouds(self, count):
        from sensor_msgs.msg import PointCloud2

        return self.collect("/drone0/mid360/points", PointCloud2, count)

    def test_a_message_of_40_MB_is_left_out(self):
        from std_msgs.msg import Float32MultiArray

        process = self.fly()
        publisher = rospy.Publisher("/drone0/cmd/rotors", Float32MultiArray, queue_size=1)
        wait_for(publisher.get_num_connections, what="the rotors' subscriber")
        publisher.publish(Float32MultiArray(data=[1.0] * 10_000_000))
        wait_for(lambda: "not taken" in open(self.log.name).read(), 40, "its rejection")
        publisher.unregister()
        self.assertIsNone(process.poll())
        self.assertIn("1 rejected", self.stop_and_read(process))

    def test_another_node_of_its_name_takes_over(self):
        first = self.fly("--no-wait")
        self.collect("/clock", rospy.AnyMsg, 10)
        first_log = self.log.name
        second = self.fly("--no-wait")
        first.wait(timeout=30)
        with open(first_log) as log:
            text = log.read()
        self.assertIn("another node of this name", text)
        self.assertEqual(first.returncode, 130)
        self.collect("/clock", rospy.AnyMsg, 10)
        self.assertIn("runs already", self.stop_and_read(second))

    # -- the rest ----------------------------------------------------------------------------

    def test_services_pause_step_and_reset(self):
        from rosgraph_msgs.msg import Clock
        from std_srvs.srv import SetBool, Trigger

        self.fly()
        latest = []
        clock = rospy.Subscriber("/clock", Clock, latest.append, queue_size=1)
        self.addCleanup(clock.unregister)
        now = lambda: latest[-1].clock.to_sec() if latest else 0.0
        services = {}
        for name, kind in (("pause", SetBool), ("step", Trigger), ("reset", Trigger)):
            rospy.wait_for_service("/pointflight/" + name, timeout=30)
            services[name] = rospy.ServiceProxy("/pointflight/" + name, kind)
        self.assertTrue(services["pause"](True).success)
        wait_for(lambda: "paused" in self.said(), what="a pause")
        time.sleep(0.2)
        still = now()
        self.assertTrue(services["step"]().success)
        wait_for(lambda: now() > still, what="a step")
        time.sleep(0.3)
        self.assertLess(now(), still + 0.15)
        self.assertTrue(services["pause"](False).success)
        wait_for(lambda: now() > still + 0.3, what="the run to go on")
        self.assertTrue(services["reset"]().success)
        wait_for(lambda: "reset: at the start again" in self.said(), what="a reset")

    # -- the end -------------------------------------------------------------------------------

    def test_ctrl_c_while_commands_arrive(self):
        """Many times (POINTFLIGHT_RUNS), each at another moment."""
        import random
        import threading
        from geometry_msgs.msg import PoseStamped, TwistStamped
        from nav_msgs.msg import Odometry

        velocity = rospy.Publisher("/drone0/cmd/velocity", TwistStamped, queue_size=10)
        goal = rospy.Publisher("/drone0/goal", PoseStamped, queue_size=10)
        over = threading.Event()

        def send():
            command = TwistStamped()
            command.header.frame_id = "world"
            aim = PoseStamped()
            aim.pose.orientation.w = 1.0
            while not over.wait(0.001):
                velocity.publish(command)
                goal.publish(aim)

        sender = threading.Thread(target=send)
        sender.start()
        seen = []
        odometry = rospy.Subscriber("/drone0/odom", Odometry, seen.append, queue_size=10)
        rng = random.Random(3)
        try:
            for _ in range(int(os.environ.get("POINTFLIGHT_RUNS", "5"))):
                process = self.fly()
                seen.clear()
                wait_for(lambda: seen, 60, "a flight")
                time.sleep(rng.uniform(0.0, 0.4))
                process.send_signal(signal.SIGINT)
                self.assertEqual(process.wait(timeout=60), 130, self.said())
                self.assertIn("interrupted, after", self.said())
        finally:
            over.set()
            sender.join()
            odometry.unregister()
            velocity.unregister()
            goal.unregister()

    # -- masters ------------------------------------------------------------------------------

    def run_beside(self, uri, *flags):
        """A flight that looks for another master; it is ended after the test."""
        return self.fly(*flags, environment={"ROS_MASTER_URI": uri})

    def said(self):
        return open(self.log.name).read()

    def test_a_master_uri_that_is_none_is_refused(self):
        for uri in ("", "localhost", "http://localhost", "http://:11311", "http://localhost:0",
                    "http://localhost:99999", "http://local host:11311", "junk:1", "http://a:b"):
            process = self.run_beside(uri)
            self.assertEqual(process.wait(timeout=30), 2, uri)
            lines = [l for l in self.said().splitlines() if l.startswith("pointflight: ")]
            self.assertEqual(len(lines), 1, self.said())
            self.assertIn(f"ROS_MASTER_URI: '{uri}'", lines[0])

    def test_ctrl_c_ends_beside_a_master_that_has_stopped(self):
        """Before it was found, and while the flight goes on."""
        for found in (True, False):
            port = free_port()
            uri = f"http://127.0.0.1:{port}"
            master = subprocess.Popen(["/usr/bin/rosmaster", "--core", "-p", str(port)],
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            self.addCleanup(master.kill)
            online = lambda: rosgraph.is_master_online(uri)
            wait_for(online, what="a master")
            if not found:
                master.send_signal(signal.SIGSTOP)
            process = self.run_beside(uri)
            if found:
                topics = rosgraph.Master("/peer", master_uri=uri)
                wait_for(lambda: "/clock" in dict(topics.getTopicTypes()), what="the node")
                time.sleep(0.5)
                master.send_signal(signal.SIGSTOP)
            else:
                wait_for(lambda: "looking for" in self.said(), what="a start")
            time.sleep(0.5)
            began = time.monotonic()
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(timeout=60), 130, self.said())
            print(f"ended {time.monotonic() - began:.2f} s after Ctrl-C", file=sys.stderr)
            if found:
                self.assertIn("interrupted, after", self.said())

    def test_a_master_that_answers_nonsense(self):
        """Of the right form at first, so that it is taken for one."""
        import threading
        import xmlrpc.server

        class Server(xmlrpc.server.SimpleXMLRPCServer):
            def _dispatch(self, method, params):
                if method == "getPid":
                    return [1, "", 1234]
                if method == "lookupNode":
                    return self.lookup
                return self.answer

        for lookup, answer in (([1, "", 5], [1, "", 0]),            # a number for a URI
                               ([0, "", ""], [1, "", "nobody"]),    # a text for a list
                               ([0, "", ""], [1, "", [1, 2, {}]]),  # a list of anything
                               ([0, "", ""], "what?"),              # no answer at all
                               ([1, "", {"a": 1}], [1])):
            server = Server(("127.0.0.1", 0), logRequests=False, allow_none=True)
            server.lookup, server.answer = lookup, answer
            threading.Thread(target=server.serve_forever, daemon=True).start()
            process = self.run_beside(f"http://127.0.0.1:{server.server_address[1]}")
            try:
                code = process.wait(timeout=8)  # refused ...
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGINT)
                code = process.wait(timeout=60)  # ... or taken as it is
            self.assertIn(code, (2, 130), self.said())
            server.shutdown()
            server.server_close()

    def test_without_a_master(self):
        environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}")
        waiting = subprocess.Popen(
            [PROGRAM, "fly", self.map, "--ros1"], env=environment, stderr=subprocess.PIPE, text=True
        )
        lines = []
        for line in waiting.stderr:
            lines.append(line)
            if "no master" in line:
                break
        self.assertIn("start roscore", lines[-1])
        waiting.send_signal(signal.SIGINT)
        self.assertEqual(waiting.wait(timeout=10), 130)
        waiting.stderr.close()
        # flies on if asked to
        done = subprocess.run(
            [PROGRAM, "fly", self.scenario(), "--ros1", "--no-wait", "--rate", "max"],
            env=environment, capture_output=True, text=True, timeout=60,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("completed", done.stdout)

    def scenario(self):
        """A flight of three metres."""
        path = self.folder.name + "/s.yaml"
        subprocess.run([PROGRAM, "scenario", "new", self.map, "-o", path, "--length", "3", "--force"],
                       check=True, capture_output=True)
        return path

    def test_a_bag_is_read_and_played(self):
        bag = self.folder.name + "/run.bag"
        subprocess.run([PROGRAM, "fly", self.scenario(), "--record", bag, "--profile", "livox"],
                       check=True, capture_output=True)
        info = subprocess.run(["/usr/bin/rosbag", "info", "-y", bag], check=True,
                              capture_output=True, text=True).stdout
        self.assertIn("livox_ros_driver2/CustomMsg", info)
        self.assertIn("e4d6829bdfe657cb6c21a746c86b21a6", info)
        with rosbag.Bag(bag) as opened:
            for topic, message, stamp in opened.read_messages(topics=["/livox/imu"]):
                self.assertAlmostEqual(message.header.stamp.to_sec(), stamp.to_sec(), delta=1e-6)
            clouds = [m for _, m, _ in opened.read_messages(topics=["/livox/lidar"])]
        self.assertEqual(clouds[0].point_num, len(clouds[0].points))  # by the bag's own definition
        got = []
        subscriber = rospy.Subscriber("/livox/imu", rospy.AnyMsg, got.append, queue_size=1000)
        subprocess.run(["/usr/bin/rosbag", "play", "-q", "-r", "5", bag], check=True,
                       capture_output=True, timeout=60)
        self.assertGreater(len(got), 100)
        subscriber.unregister()
        # cut short: said, and whole chunks come back
        with open(bag, "rb") as source:
            data = source.read()
        cut = self.folder.name + "/cut.bag"
        with open(cut, "wb") as target:
            target.write(data[: len(data) * 3 // 4])
        told = subprocess.run([PROGRAM, "bag", "info", cut], capture_output=True, text=True)
        self.assertEqual(told.returncode, 2)
        subprocess.run(["/usr/bin/rosbag", "reindex", "-q", cut], check=True, capture_output=True)
        with rosbag.Bag(cut) as opened:
            self.assertGreater(opened.get_message_count(), 100)

    def test_a_full_disk_leaves_a_bag_that_reindexes(self):
        bag = self.folder.name + "/full.bag"

        def small_disk():
            resource.setrlimit(resource.RLIMIT_FSIZE, (2 << 20, 2 << 20))
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # as a disk: an error, no signal

        done = subprocess.run([PROGRAM, "fly", self.scenario(), "--record", bag],
                              preexec_fn=small_disk, capture_output=True, text=True)
        self.assertEqual(done.returncode, 2, done.stderr)
        said = [line for line in done.stderr.splitlines() if "full.bag" in line]
        self.assertEqual(len(said), 1, done.stderr)
        self.assertIn("full.bag.active: writing failed", said[0])
        self.assertFalse(os.path.exists(bag))
        os.rename(bag + ".active", bag)
        subprocess.run(["/usr/bin/rosbag", "reindex", "-q", bag], check=True, capture_output=True)
        with rosbag.Bag(bag) as opened:
            self.assertGreater(opened.get_message_count(), 100)

    def test_lockstep_waits_for_the_planner(self):
        """Two flights, one beside a slow planner, are the same to the last bit."""
        from nav_msgs.msg import Odometry
        from sensor_msgs.msg import PointCloud2
        from geometry_msgs.msg import TwistStamped

        flights = []
        for delay in (0.0, 0.12):
            poses = []
            scans = []
            publisher = rospy.Publisher("/drone0/cmd/velocity", TwistStamped, queue_size=10)

            def plan(cloud):
                time.sleep(delay)
                scans.append(cloud.header.stamp.to_nsec())
                command = TwistStamped()
                command.header.frame_id = "world"
                command.twist.linear.z = 0.3 if len(scans) % 3 else -0.2
                publisher.publish(command)

            planner = rospy.Subscriber("/drone0/mid360/points", PointCloud2, plan, queue_size=10)
            recorder = rospy.Subscriber("/drone0/odom", Odometry, poses.append, queue_size=1000)
            process = self.fly("--lockstep", "10")
            wait_for(lambda: len(scans) > 30, 60, "three seconds of flight")
            self.assertNotIn("no command within", self.stop_and_read(process))
            for endpoint in (planner, recorder, publisher):
                endpoint.unregister()
            time.sleep(0.5)  # until the master has heard of it
            flights.append(
                (scans[:30], {p.header.stamp.to_nsec(): p.pose.pose.position.z for p in poses})
            )
        (first_scans, first), (second_scans, second) = flights
        self.assertEqual(first_scans, second_scans)
        common = [t for t in sorted(set(first) & set(second)) if t < first_scans[-1]]
        self.assertGreater(len(common), 400)
        self.assertEqual([first[t] for t in common], [second[t] for t in common])
        self.assertGreater(max(first.values()) - min(first.values()), 0.1)


if __name__ == "__main__":
    unittest.main(verbosity=2, warnings="ignore")
