"""A simulated arm as others see it: its bent links as markers, and their frames on ``/tf``."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from flex_planner.arms.arm import Arm
from flex_planner.arms.frames import name_frames
from flex_planner.base.validation import Array
from flex_planner.ros.messages.frames import frame_transforms
from flex_planner.ros.messages.markers import arm_markers
from flex_planner.ros.settings.simulator import SimulatorSettings
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

_DEPTH = 10


class ArmPicture:
    """
    Publishes ``~/markers`` and, where tf2_msgs is installed, ``/tf``.

    Parameters
    ----------
    node : Node
        The simulator.
    arm : Arm
        As it is simulated.
    settings : SimulatorSettings
        With the names of frames.

    """

    def __init__(self, node: Node, arm: Arm, settings: SimulatorSettings) -> None:
        self._arm, self._base = arm, settings.base_frame
        _, *names = name_frames(arm)
        self._names = [self._base, *(f'{settings.frame_prefix}{name}' for name in names)]
        self._markers = node.create_publisher(MarkerArray, '~/markers', 1)
        self._frames = None
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            node.get_logger().info('no frames on /tf: tf2_msgs is not installed')
            return
        self._message = TFMessage
        self._frames = node.create_publisher(TFMessage, '/tf', _DEPTH)

    def show(self, coordinates: Array, stamp: Time) -> None:
        """Publish the arm with coordinates q (n_t,) at a time, to those who listen."""
        if self._markers.get_subscription_count():
            markers = arm_markers(self._arm, coordinates, self._base)
            for marker in markers.markers:
                marker.header.stamp = stamp
            self._markers.publish(markers)
        if self._frames is not None and self._frames.get_subscription_count():
            self._frames.publish(self._message(transforms=frame_transforms(
                self._arm, coordinates, self._names, stamp)))
