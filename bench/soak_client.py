"""A client of a planner that asks for everything it answers."""

from __future__ import annotations

from typing import Any

from bench.stress import Client, NODE, PATIENCE, task
from flex_planner_interfaces import action, srv
from flex_planner_interfaces.msg import PlanReport
from rcl_interfaces.srv import SetParameters
from rclpy.action import ActionClient
from rclpy.parameter import Parameter

_WAITING = 'waiting'  # the phase of a goal begins with it until its turn has come


class SoakGoal:
    """A goal that was accepted."""

    def __init__(self, client: SoakClient, actions: ActionClient, goal: Any) -> None:
        self._client, self._phases = client, ['']
        self._handle = client.wait(actions.send_goal_async(
            goal, lambda message: self._phases.append(message.feedback.phase)))
        self._result = self._handle.get_result_async()

    def works(self) -> bool:
        """Return whether the planner is at work on it."""
        return bool(self._phases[-1]) and not self._phases[-1].startswith(_WAITING)

    def cancel(self) -> None:
        """Cancel it."""
        self._client.wait(self._handle.cancel_goal_async())

    def report(self) -> PlanReport:
        """Wait for its end and return the report."""
        report: PlanReport = self._client.wait(self._result).result.report
        return report


class SoakClient(Client):
    """Calls every service and action of a planner."""

    def __init__(self) -> None:
        super().__init__()
        self._services = {kind: self.node.create_client(kind, f'{NODE}/{name}')
                          for kind, name in ((srv.PlanPath, 'plan_path'),
                                             (srv.FindMaxPayload, 'find_max_payload'),
                                             (SetParameters, 'set_parameters'))}
        self._searches = ActionClient(self.node, action.FindMaxPayload, f'{NODE}/find_max_payload')
        self._searches.wait_for_server(PATIENCE)
        for service in self._services.values():
            service.wait_for_service(PATIENCE)

    def close(self) -> None:
        """Leave ROS."""
        self._searches.destroy()
        super().close()

    def _call(self, request: Any, kind: Any) -> Any:
        return self.wait(self._services[kind].call_async(request))

    def plan(self, **fields: Any) -> PlanReport:
        """Ask for a plan by the service."""
        report: PlanReport = self._call(srv.PlanPath.Request(task=task(**fields)),
                                        srv.PlanPath).report
        return report

    def search(self, *, payload_accuracy: float, **fields: Any) -> PlanReport:
        """Ask for the largest payload by the service."""
        report: PlanReport = self._call(srv.FindMaxPayload.Request(
            task=task(**fields), payload_accuracy=payload_accuracy), srv.FindMaxPayload).report
        return report

    def plan_goal(self, **fields: Any) -> SoakGoal:
        """Ask for a plan by the action."""
        return SoakGoal(self, self._goals, action.PlanPath.Goal(task=task(**fields)))

    def search_goal(self, **fields: Any) -> SoakGoal:
        """Ask for the largest payload by the action."""
        return SoakGoal(self, self._searches, action.FindMaxPayload.Goal(task=task(**fields)))

    def set_parameter(self, name: str, value: object) -> bool:
        """Set a parameter; return whether the node accepts it."""
        change = Parameter(name, value=value).to_parameter_msg()
        answer = self._call(SetParameters.Request(parameters=[change]), SetParameters)
        return bool(answer.results[0].successful)
