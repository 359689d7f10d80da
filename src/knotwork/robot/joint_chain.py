"""Extraction of a serial chain, from a base link to a tool link, out of a larger model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import pinocchio as pin

from knotwork.errors import RobotError, UnknownNameError
from knotwork.robot.robot_spec import RobotSpec
from knotwork.robot.urdf import Urdf

MAX_JOINTS = 200
"""Maximum number of planned joints. Proofs for chains of hundreds of joints take gigabytes."""
_NO_JOINT = "\x01"
"""A character that XML can't contain, so that no name of a joint begins with it."""


class JointChain(NamedTuple):
    """The planned joints, with all others locked.

    Attributes:
        model: Pinocchio model of the chain: nq = nv = the number of its joints.
        joint_names: Names of its joints, base first.
        base_frame: Link of the frame of poses; it does not move.
        locked: Position of every locked joint of one degree of freedom [rad or m].
        followers: The planned joint that a locked joint mimics, by the name of the latter.
    """

    model: Any
    joint_names: tuple[str, ...]
    base_frame: str
    locked: Mapping[str, float]
    followers: Mapping[str, str]


def select_chain(spec: RobotSpec) -> JointChain:
    """Lock every joint that is not between the base and the tool.

    Without a tool frame all supported joints are kept.

    Raises:
        UnknownNameError: The robot has no such link or joint.
        RobotError: The base does not carry the tool, no joint moves the tool, a joint between them
            is not supported, or a joint can't be locked at its position.
    """
    urdf, robot_name, locked = spec.urdf, spec.name, spec.locked
    tool_frame = spec.tool_frame
    full = urdf.model
    base = spec.base_frame or urdf.root
    for link in (base, tool_frame):
        if link is not None and link not in urdf.links:
            raise UnknownNameError("link", link, urdf.links, where=f"robot {robot_name!r}")
    if tool_frame is None:
        moving = [i for i in range(1, full.njoints) if _explain_unsupported(urdf, i) is None]
        moving = [i for i in moving if full.names[i] not in locked]
    else:
        moving = _find_moving_joints(urdf, robot_name, base, tool_frame, locked)
    if len(moving) > MAX_JOINTS:
        raise RobotError(
            robot_name,
            f"{len(moving)} joints would be planned, but at most {MAX_JOINTS} can be; give a "
            "tool frame that fewer of them carry, or list others under `locked`",
        )
    planned = set(moving)
    still = [i for i in range(1, full.njoints) if i not in planned]
    reference, values = _find_locked_configuration(
        urdf, robot_name, still, {**spec.unplanned, **locked}
    )
    names = tuple(full.names[i] for i in moving)
    mimicked = {full.names[i]: _list_mimicked(urdf, full.names[i], locked) for i in still}
    return JointChain(
        model=_reduce_model(full, still, reference),
        joint_names=names,
        base_frame=base,
        locked=values,
        followers={name: of[-1] for name, of in mimicked.items() if of and of[-1] in names},
    )


def _list_mimicked(urdf: Urdf, name: str, locked: Mapping[str, float]) -> list[str]:
    """List the joints that a joint mimics, directly or through others, up to a locked one."""
    masters: list[str] = []
    while name in urdf.mimics and name not in locked and len(masters) < len(urdf.mimics):
        name = urdf.mimics[name].joint
        masters.append(name)
    return masters


def _reduce_model(full: Any, still: list[int], reference: Any) -> Any:
    """Lock the joints of the indices `still`."""
    model = full.copy()
    # Pinocchio finds frames by name, and a link may have the name of a joint.
    links = [frame for frame in model.frames if frame.type == pin.FrameType.BODY]
    for frame in links:
        frame.name = f"{_NO_JOINT}{frame.name}"
    reduced = pin.buildReducedModel(model, still, reference)
    for frame in reduced.frames:
        frame.name = frame.name.removeprefix(_NO_JOINT)
    return reduced


def _explain_unsupported(urdf: Urdf, index: int) -> str | None:
    """Explain why a joint is not supported; `None` if it is."""
    name = urdf.model.names[index]
    if name in urdf.mimics:
        return f"mimics joint {urdf.mimics[name].joint!r}"
    joint = urdf.model.joints[index]
    if joint.nv != 1:
        return f"is of type {urdf.types.get(name, joint.shortname())!r} with {joint.nv} freedoms"
    return None


def _find_moving_joints(
    urdf: Urdf, robot_name: str, base: str, tool: str, locked: Mapping[str, float]
) -> list[int]:
    full = urdf.model
    base_joint, tool_joint = (
        full.frames[full.getFrameId(link, pin.BODY)].parentJoint for link in (base, tool)
    )
    carriers = list(full.supports[tool_joint])
    if base_joint not in carriers:
        raise RobotError(
            robot_name,
            f"tool frame {tool!r} is not carried by base frame {base!r}; give a base frame on "
            f"the way from the root {urdf.root!r} to the tool",
            link=tool,
        )
    chain = carriers[carriers.index(base_joint) + 1 :]
    moving = [i for i in chain if full.names[i] not in locked]
    if not moving:
        locked_names = [full.names[i] for i in chain]
        why = f"; these joints are locked: {', '.join(locked_names)}" if locked_names else ""
        message = f"no joint moves tool frame {tool!r} relative to base frame {base!r}{why}"
        raise RobotError(robot_name, message, link=tool)
    for i in moving:
        why_not = _explain_unsupported(urdf, i)
        if why_not is not None:
            raise RobotError(
                robot_name,
                f"joint {full.names[i]!r} on the way to {tool!r} {why_not}, which is not supported "
                "(revolute, continuous and prismatic joints are); lock it "
                f"with `locked: {{{full.names[i]}: 0}}`",
                joint=full.names[i],
            )
    return moving


def _find_locked_configuration(
    urdf: Urdf, robot_name: str, still: list[int], locked: Mapping[str, float]
) -> tuple[Any, dict[str, float]]:
    """Find the configuration of the whole model at which joints are locked, and its values."""
    full = urdf.model
    reference = pin.neutral(full)
    values: dict[str, float] = {}
    # Independent joints come first, because joints that mimic them need their positions.
    for i in sorted(still, key=lambda i: len(_list_mimicked(urdf, full.names[i], locked))):
        name, joint = full.names[i], full.joints[i]
        wanted = locked.get(name)
        if joint.nq != 1:
            if wanted:
                raise RobotError(
                    robot_name,
                    f"joint {name!r} of type {urdf.types.get(name)!r} can only be locked at 0, "
                    f"where it is neutral, not at {wanted:g}",
                    joint=name,
                )
            continue
        mimic = urdf.mimics.get(name)
        lower, upper = full.lowerPositionLimit[joint.idx_q], full.upperPositionLimit[joint.idx_q]
        if wanted is None and mimic is not None and mimic.joint in values:
            wanted = mimic.multiplier * values[mimic.joint] + mimic.offset
        elif wanted is None:
            wanted = min(max(0.0, lower), upper)
        elif not lower <= wanted <= upper:
            raise RobotError(
                robot_name,
                f"joint {name!r} is locked at {wanted:g}, outside its limits "
                f"[{lower:g}, {upper:g}] {'m' if urdf.types[name] == 'prismatic' else 'rad'}",
                joint=name,
            )
        values[name] = float(wanted)
        reference[joint.idx_q] = wanted
    return reference, values
