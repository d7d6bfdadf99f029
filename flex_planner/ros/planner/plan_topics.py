"""The topics on which the planner node publishes plans."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.ros.messages.feedback import feedback_message
from flex_planner.ros.messages.markers import motion_markers
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.running_plan import RunningPlan, RunningPlans, Track
from flex_planner.ros.planner.streamer import Streamer
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import FeedbackGains, FlexibleTrajectory
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                     durability=DurabilityPolicy.TRANSIENT_LOCAL)


class PlanTopics:
    """
    Publishes plans, streams them, and knows which one is carried out.

    Parameters
    ----------
    node : Node
        The planner.
    record : callable, optional
        Records the motion of a trajectory from now on, given the settings of its request, too;
        None if motions are not recorded.

    Attributes
    ----------
    running : RunningPlans
        What was published last.
    streamer : Streamer
        Of ``~/reference_states``.
    joints : Publisher
        Of ``~/joint_trajectory``.

    """

    def __init__(self, node: Node,
                 record: Callable[[JointTrajectory, PlannerSettings], None] | None) -> None:
        self._node, self._record = node, record
        self.running, self.streamer = RunningPlans(), Streamer(node)
        self.joints = node.create_publisher(JointTrajectory, '~/joint_trajectory', LATCHED)
        self._flexible = node.create_publisher(
            FlexibleTrajectory, '~/flexible_trajectory', LATCHED)
        self._gains = node.create_publisher(FeedbackGains, '~/feedback_gains', LATCHED)
        self._markers = node.create_publisher(MarkerArray, '~/markers', LATCHED)

    def track(self, outcome: Outcome) -> Track:
        """Return a plan as it is published now, after what is left of one that it replaces."""
        now_ns = self._now_ns()
        if outcome.replaces:
            return self.running.take(outcome.replaces).replaced_by(outcome, now_ns)
        assert outcome.reference is not None
        return Track.of(outcome.reference, outcome.start_ns or now_ns)

    def trajectory(self, outcome: Outcome, track: Track) -> JointTrajectory:
        """
        Return what a controller gets.

        Of a plan that replaces another one that is what is left of the other, too: a controller
        drops what it has, and would find a way of its own to a start that is still to come.

        """
        joints = outcome.trajectory.joint_trajectory
        if not outcome.replaces:
            return joints
        return track.part(self._now_ns()).trajectory(list(joints.joint_names))

    def publish(self, outcome: Outcome, settings: PlannerSettings,
                track: Track | None = None) -> None:
        """
        Publish a plan and stream it from now on, with what leads there.

        Parameters
        ----------
        outcome : Outcome
            With a trajectory.
        settings : PlannerSettings
            Of its request.
        track : Track, optional
            As a controller has it already.

        """
        plan, reference = outcome.plan, outcome.reference
        assert plan is not None
        assert reference is not None
        if track is None or not outcome.start_ns:  # which begins now
            track = self.track(outcome)
        markers: MarkerArray | None = None  # before anything is published, should they fail
        if not outcome.replaces or self._markers.get_subscription_count():
            markers = motion_markers(plan.arm, reference, settings.base_frame,
                                     plan.task.path_constraints, plan.via_times)
        if outcome.gains is not None:  # first: a controller has them when it begins
            self._gains.publish(feedback_message(outcome.gains, plan, settings.joint_names,
                                                 settings.base_frame))
        joints = self._joints_of(outcome, track, settings)
        if not outcome.start_ns:  # all that follows it has to begin when a controller gets it
            track = replace(track, begin_ns=self._now_ns())
        begin_ns = (outcome.start_ns or track.begin_ns) + round(reference.start_hold * 1e9)
        self.running.begin(RunningPlan(plan_id=outcome.report.plan_id, plan=plan,
                                       begin_ns=begin_ns, track=track))
        self.joints.publish(joints)
        # what is left of a plan that was replaced is not streamed anew
        self.streamer.start(plan, track.part(self._now_ns()) if outcome.replaces else track,
                            settings)
        self._flexible.publish(outcome.trajectory)
        if markers is not None:
            self._markers.publish(markers)

    def _joints_of(self, outcome: Outcome, track: Track,
                   settings: PlannerSettings) -> JointTrajectory | bytes:
        """Return what a controller gets, and have its motion recorded if motions are."""
        if outcome.replaces and self._record is None:  # nobody here needs the message itself
            names = list(outcome.trajectory.joint_trajectory.joint_names)
            return track.part(self._now_ns()).encoded(names)
        joints = self.trajectory(outcome, track)
        if self._record is not None:
            self._record(joints, settings)
        return joints

    def _now_ns(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)
