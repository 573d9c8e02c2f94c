"""What ROS 1 itself does with a bag: reads it, plays it, says where tf has the flange, and records it again.

Run by the Python that Debian's ROS is installed for: ros_peer.py BAG COPY SAID BASE FLANGE [SPEED]
What it has to say goes into the file SAID; then it holds the last pose until it is ended, as RViz may come late.
"""

import json
import sys
from pathlib import Path

import rosbag
import rospy
import tf2_ros
from sensor_msgs.msg import JointState

SETTLED = 60  # times that the last message is sent: robot_state_publisher leaves some out


def main(bag, copy, said, base, flange, speed="20"):
    """Write what was read and where the flange is as JSON."""
    rospy.init_node("replay", anonymous=True)
    with rosbag.Bag(bag) as file:
        messages = list(file.read_messages())
    with rosbag.Bag(copy, "w", compression="bz2") as file:
        for topic, message, time in messages:
            file.write(topic, message, time)
    states = [(message, time.to_sec()) for topic, message, time in messages if topic == "/joint_states"]
    publisher = rospy.Publisher("/joint_states", JointState, queue_size=1000)
    listener = tf2_ros.Buffer()
    tf2_ros.TransformListener(listener)
    while publisher.get_num_connections() == 0 and not rospy.is_shutdown():
        rospy.sleep(0.05)
    before = states[0][1]
    for message, time in states + [states[-1]] * SETTLED:
        rospy.sleep(max(time - before, 0.0) / float(speed) if time > before else 0.02)
        before = time
        message.header.stamp = rospy.Time.now()
        publisher.publish(message)
    found = listener.lookup_transform(base, flange, rospy.Time(0), rospy.Duration(5.0)).transform
    found_there = {
        "messages": len(messages),
        "topics": sorted({topic for topic, _, _ in messages}),
        "seconds": states[-1][1] - states[0][1],
        "translation": [found.translation.x, found.translation.y, found.translation.z],
        "rotation": [found.rotation.x, found.rotation.y, found.rotation.z, found.rotation.w],
    }
    part = Path(said + ".part")
    part.write_text(json.dumps(found_there))
    part.rename(said)  # whole or not there
    while not rospy.is_shutdown():
        message.header.stamp = rospy.Time.now()
        publisher.publish(message)
        rospy.sleep(0.1)


main(*sys.argv[1:])
