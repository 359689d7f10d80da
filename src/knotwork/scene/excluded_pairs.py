"""Pairs of bodies that a scenario excludes from the check by `allow` and `ignore`."""

from __future__ import annotations

from collections.abc import Sequence

from knotwork.errors import UnknownNameError
from knotwork.files.documents import Location, Locations
from knotwork.robot import Robot
from knotwork.scene.bodies import Body
from knotwork.scene.collision_model import TOOL_BODY, Exclusion
from knotwork.task.scenario import Scene

Exclusions = dict[frozenset[str], Exclusion]


def read_exclusions(
    scene: Scene, robot: Robot, bodies: Sequence[Body], locations: Locations
) -> Exclusions:
    """Find the pairs that `allow` and `ignore` exclude, each with the reason.

    Raises:
        InputError: A name is unknown or ambiguous, or an object has the name of a link.
    """
    names = _Names(robot, bodies, locations)
    exclusions: Exclusions = {}
    items = [(("scene", "objects", item.name), item.name, item.allow) for item in scene.objects]
    items += [(("tool", "holds", held.name), held.name, held.allow) for held in scene.held]
    for location, name, allowed in items:
        if name in robot.link_names:
            raise locations.error(location, "is the name of a link of the robot", "any other name")
        identity = f"scenario:{name}"
        for other in names.identities(allowed, (*location, "allow"), TOOL_BODY):
            if other == identity:
                fault = f"names {name!r} itself"
                raise locations.error(
                    (*location, "allow"), fault, "names of bodies that may touch it"
                )
            exclusions[frozenset((identity, other))] = Exclusion.ALLOWED
    for i, pair in enumerate(scene.collisions.ignore):
        at = ("collisions", "ignore", i)
        identities = names.identities(pair, at)
        if pair[0] == pair[1] or len(identities) != len(set(identities)):
            raise locations.error(at, f"names {pair[0]!r} twice", "two names")
        if len(identities) == len(pair):
            exclusions[frozenset(identities)] = Exclusion.IGNORED
    return exclusions


class _Names:
    """Names of the robot's links and of the scenario's bodies."""

    def __init__(self, robot: Robot, bodies: Sequence[Body], locations: Locations) -> None:
        self.locations = locations
        self.meanings: dict[str, set[str]] = {}
        for body in bodies:
            for name in (body.link or body.name, body.identity):
                self.meanings.setdefault(name, set()).add(body.identity)
        self.link_names = {name for link in robot.link_names for name in (link, f"link:{link}")}
        self.listed = [*(body.link or body.name for body in bodies), *robot.link_names]

    def identities(self, named: Sequence[str], location: Location, also: str = "") -> list[str]:
        """Identities of the named bodies; a link without shapes has none.

        Args:
            named: The names.
            location: Location of the names.
            also: One further accepted name, with or without shapes.
        """
        identities = []
        where = self.locations.where(location)
        for name in named:
            meanings = sorted(self.meanings.get(name, ()))
            if len(meanings) > 1:
                fault = f"{name!r} is a link of the robot and a body of the scenario"
                raise self.locations.error(location, fault, " or ".join(map(repr, meanings)))
            identities += meanings
            if not meanings and name != also and name not in self.link_names:
                names = dict.fromkeys([*self.listed, also] if also else self.listed)
                raise UnknownNameError("link or object", name, list(names), where=where)
        return identities
