from .active_limits import ActiveLimit as ActiveLimit
from .budget import Progress as Progress
from .minimum_durations import lower_bound as lower_bound
from .solving import solve as solve
from .symbolic_dynamics import Dynamics as Dynamics
from .timed_motion import TimedMotion as TimedMotion
from .timing_problem import Objective as Objective
from .timing_problem import TimingProblem as TimingProblem
