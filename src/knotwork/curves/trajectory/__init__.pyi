from .joint_trajectory import Continuity as Continuity
from .joint_trajectory import JointTrajectory as JointTrajectory
from .joint_trajectory import Jump as Jump
from .motion_events import Event as Event
from .motion_events import Load as Load
from .motion_events import Segment as Segment
from .sampling import Knots as Knots
from .sampling import Samples as Samples
