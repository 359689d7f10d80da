"""A controller of Universal Robots that runs a program, as its manual says the commands work.

The program is translated to Python line by line, so that its own text is what runs. `speedj(qd, a,
t)` changes the joints' velocities linearly, all in the same time, the fastest change with the
acceleration a; then they stay, and it returns after time t in whole steps. Positions are the exact
integral.
"""

from __future__ import annotations

import math
import re
from functools import partial
from typing import Any

import numpy as np

LITERAL = re.compile(r"(?<![\w\])])\[([^\[\]]*)\]")
BLOCK = re.compile(r"(def|while|if) .*:$")


class PopupError(Exception):
    """The program has given up with this message."""


class Controller:
    """An arm at positions q [rad], whose controller makes `rate` steps a second [Hz].

    Attributes:
        time: Ends of the steps [s], shape (n,).
        position: Targets then [rad], shape (n, 6).
        velocity: Their velocities [rad/s], shape (n, 6).
        payloads: As they are set: time [s], mass [kg], centre of mass [m].
        inertias: As they are set with these: xx, yy, zz, xy, xz, yz [kg m²], or `None`.
        tcp: The tool centre point: position [m] and rotation vector [rad].
        switched: Digital outputs as they are switched: time [s], kind, number, value.
    """

    def __init__(self, q: np.ndarray, rate: float) -> None:
        self.step = 1.0 / rate
        self.q, self.qd = np.array(q, dtype=float), np.zeros(6)
        self._states = [(0.0, self.q, self.qd)]
        self.switched: list[tuple[float, str, int, bool]] = []
        self.payloads: list[tuple[float, float, list[float]]] = []
        self.inertias: list[np.ndarray | None] = []
        self.tcp = np.zeros(6)
        self._hit: tuple[float, np.ndarray] | None = None

    def push(self, time: float, by: np.ndarray) -> None:
        """Put the arm off by so much at a time [s]."""
        self._hit = time, by

    def run(self, program: str) -> None:
        names: dict[str, Any] = {
            "vector": lambda *values: np.array(values, dtype=float),
            "norm": abs,
            "pow": pow,
            "get_steptime": lambda: self.step,
            "get_target_joint_positions": lambda: self.q.copy(),
            "speedj": self._speedj,
            "stopj": self._stopj,
            "set_payload": self._set_payload,
            "set_target_payload": self._set_payload,
            "set_tcp": self._set_tcp,
            "textmsg": lambda *text: None,
            "popup": self._popup,
        }
        for kind in ("standard", "configurable", "tool"):
            names[f"set_{kind}_digital_out"] = partial(self._switch, kind)
        exec(_python(program), names)
        self.time, self.position, self.velocity = map(np.array, zip(*self._states, strict=True))

    def _speedj(self, qd: np.ndarray, a: float, t: float) -> None:
        assert a > 0.0
        ramp = float(np.abs(qd - self.qd).max()) / a
        for _ in range(math.ceil(t / self.step - 1e-9)):
            share = min(1.0, self.step / ramp) if ramp > 0.0 else 1.0
            end = self.qd + share * (qd - self.qd)
            during = min(ramp, self.step)
            self.q = self.q + 0.5 * during * (self.qd + end) + (self.step - during) * end
            self.qd, ramp = end, max(0.0, ramp - self.step)
            time = len(self._states) * self.step
            if self._hit is not None and time >= self._hit[0]:
                self.q, self._hit = self.q + self._hit[1], None
            self._states.append((time, self.q, self.qd))

    def _switch(self, kind: str, number: int, value: bool) -> None:
        assert 0 <= number < (2 if kind == "tool" else 8)
        assert value in (True, False)
        self.switched.append((self._states[-1][0], kind, number, value))

    def _set_payload(
        self, mass: float, centre: np.ndarray, inertia: np.ndarray | None = None
    ) -> None:
        assert mass >= 0.0
        self.payloads.append((self._states[-1][0], mass, centre.tolist()))
        self.inertias.append(inertia)

    def _set_tcp(self, pose: np.ndarray) -> None:
        assert pose.shape == (6,)
        self.tcp = pose

    def _stopj(self, a: float) -> None:
        while np.abs(self.qd).max() > 1e-12:
            self._speedj(np.zeros(6), a, self.step)

    def _popup(self, text: str, *, title: str, error: bool, blocking: bool) -> None:
        raise PopupError(text)


def _python(program: str) -> str:
    """The same in Python: blocks by indentation, lists of numbers as vectors."""
    lines, depth = [], 0
    shared = re.findall(r"^\s*global (\w+)", program, re.MULTILINE)
    for raw in program.splitlines():
        line = raw.strip()
        if not line or line.startswith("#"):
            continue
        if line == "end":
            depth -= 1
            assert depth >= 0
            continue
        line = re.sub(r"\bp\[([^\]]*)\]", r"vector(\1)", line)
        line = LITERAL.sub(r"vector(\1)", re.sub(r"^(local|global) ", "", line))
        lines.append(" " * depth + ("raise SystemExit" if line == "halt" else line))
        if BLOCK.match(line):
            depth += 1
            if line.startswith("def "):
                lines.append(" " * depth + f"global {', '.join(shared)}")
    assert depth == 0
    return "\n".join([*lines, "knotwork_motion()"])
