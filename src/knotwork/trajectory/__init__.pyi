from .events import Event as Event
from .events import Load as Load
from .events import Segment as Segment
from .joint_trajectory import Continuity as Continuity
from .joint_trajectory import JointTrajectory as JointTrajectory
from .joint_trajectory import Jump as Jump
from .sampling import Knots as Knots
from .sampling import Samples as Samples
