"""Pairs of bodies checked for collisions, and the reasons of excluded ones."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from knotwork.errors import InputError
from knotwork.files.documents import read_text
from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree
from knotwork.robot.urdf import MAX_URDF_BYTES, parse_root
from knotwork.robot.urdf_rules import child_elements
from knotwork.scene.bodies import Body
from knotwork.scene.collision_model import ExcludedPair, Exclusion, Pair
from knotwork.scene.excluded_pairs import Exclusions
from knotwork.task.scenario import Scene


class Pairing:
    """Selects the pairs of bodies to check.

    Args:
        robot: The robot.
        tree: Its joints, followed by those of known motions.
        scene: The surroundings, and the rules of the check.
        excluded: Pairs that the scenario excludes, by the identities of the two bodies.
    """

    def __init__(self, robot: Robot, tree: JointTree, scene: Scene, excluded: Exclusions) -> None:
        self.scene, self.by_scenario = scene, excluded
        self.srdf_reasons = _read_srdf(robot)
        self.by_files = dict.fromkeys(self.srdf_reasons, Exclusion.BY_SRDF)
        self.by_files |= {frozenset(pair): Exclusion.BY_ROBOT for pair in robot.ignored_pairs}
        self.own_carriers = tree.carriers[:, : robot.model.njoints]
        self.joined = robot.joined_links
        self.held = {item.name for item in scene.held}

    def pairs(self, bodies: Sequence[Body]) -> tuple[list[Pair], list[ExcludedPair]]:
        """List the pairs to check, and the excluded ones with the reason."""
        pairs, excluded = [], []
        for (i, first), (j, second) in itertools.combinations(enumerate(bodies), 2):
            if first.start >= second.end or second.start >= first.end:
                continue
            if first.joint == second.joint and first.kind == second.kind:
                continue  # they are one rigid body
            if exclusion := self._exclusion(first, second):
                by_srdf = exclusion is Exclusion.BY_SRDF
                reason = self.srdf_reasons[frozenset((first.link, second.link))] if by_srdf else ""
                names = self._reported_name(first), self._reported_name(second)
                excluded.append(ExcludedPair(*names, exclusion, reason))
                continue
            involves_scene = "object" in (first.kind, second.kind)
            second_moves = second.kind != "object" if involves_scene else bool(second.joint)
            order = (i, j) if second_moves else (j, i)
            pairs.append(Pair(*order, self.scene.margin if involves_scene else 0.0, involves_scene))
        return pairs, [pair for pair in dict.fromkeys(excluded) if pair.first != pair.second]

    def _reported_name(self, body: Body) -> str:
        """Name of a body in reports: bodies of another robot are listed under its name."""
        robots = (
            robot.name for robot in self.scene.robots if body.name.startswith(f"{robot.name}/")
        )
        return next(robots, body.name) if body.kind == "object" else body.name

    def _exclusion(self, first: Body, second: Body) -> Exclusion | None:
        """Reason why a pair of bodies is excluded, or `None` if it is checked."""
        if first.joint == second.joint:
            return Exclusion.MOVE_TOGETHER if first.joint else Exclusion.NEITHER_MOVES
        kinds = {first.kind, second.kind}
        if kinds <= {"link", "tool"} and not self.scene.collisions.itself:
            return Exclusion.SELF_CHECK_OFF
        exclusion = self.by_scenario.get(frozenset((first.identity, second.identity)))
        keeps_clear = first.tool_keeps_clear or second.tool_keeps_clear
        if exclusion is not None and not (exclusion is Exclusion.ALLOWED and keeps_clear):
            return exclusion  # only the gripper may touch an object, and only during this time
        carriers, other_carriers = self.own_carriers[[first.joint, second.joint]]
        if kinds == {"object"} and (carriers == other_carriers).all():
            return Exclusion.NOT_MOVED_BY_ROBOT
        if kinds == {"link"}:
            links = frozenset((first.link, second.link))
            by_joint = Exclusion.ADJACENT if links in self.joined else None
            return self.by_files.get(links, by_joint)
        carried = "tool" in kinds and "link" not in kinds and {first.name, second.name} & self.held
        return Exclusion.CARRIED if carried and not keeps_clear else None


def _read_srdf(robot: Robot) -> dict[frozenset[str], str]:
    """Read the pairs of links that the robot's SRDF excludes, and the reasons that it gives.

    Raises:
        InputError: The SRDF can't be read, or is not one.
    """
    if robot.srdf is None:
        return {}
    text = read_text(robot.srdf, max_bytes=MAX_URDF_BYTES)
    try:
        root = parse_root(text)
    except InputError as error:
        raise InputError(f"{robot.srdf} is not an SRDF: {error}") from error
    if root is None or root.tagName != "robot":
        raise InputError(f"{robot.srdf} is not an SRDF: its outermost element is not <robot>")
    reasons: dict[frozenset[str], str] = {}
    for element in child_elements(root, "disable_collisions"):
        links = frozenset(element.getAttribute(end) for end in ("link1", "link2"))
        reasons.setdefault(links, element.getAttribute("reason").lower())
    return reasons
