"""Every error Knotwork raises on purpose: one base class, each leaf with its data.

The command line turns `InputError` into exit code 2 and `CheckFailedError` into exit code 1.
"""

from knotwork.errors.base import CheckFailedError as CheckFailedError
from knotwork.errors.base import CollisionError as CollisionError
from knotwork.errors.base import DocumentError as DocumentError
from knotwork.errors.base import ExportError as ExportError
from knotwork.errors.base import InputError as InputError
from knotwork.errors.base import KnotError as KnotError
from knotwork.errors.base import KnotworkError as KnotworkError
from knotwork.errors.base import OptionError as OptionError
from knotwork.errors.base import Problem as Problem
from knotwork.errors.base import RobotError as RobotError
from knotwork.errors.base import TimeRangeError as TimeRangeError
from knotwork.errors.base import UnknownNameError as UnknownNameError
from knotwork.errors.base import WaypointDataError as WaypointDataError
from knotwork.errors.base import did_you_mean as did_you_mean
from knotwork.errors.base import shown as shown
from knotwork.errors.base import together as together
from knotwork.errors.paths import CornerError as CornerError
from knotwork.errors.paths import PathError as PathError
from knotwork.errors.paths import RampError as RampError
from knotwork.errors.paths import SlowStretchError as SlowStretchError
from knotwork.errors.paths import StretchTimeError as StretchTimeError
from knotwork.errors.tasks import BranchError as BranchError
from knotwork.errors.tasks import FollowingError as FollowingError
from knotwork.errors.tasks import NoWayFoundError as NoWayFoundError
from knotwork.errors.tasks import OutOfReachError as OutOfReachError
from knotwork.errors.tasks import OutsideLimitsError as OutsideLimitsError
from knotwork.errors.tasks import SingularityError as SingularityError
from knotwork.errors.tasks import TaskError as TaskError
from knotwork.errors.tasks import TimingError as TimingError
from knotwork.errors.tasks import UnreachablePoseError as UnreachablePoseError
