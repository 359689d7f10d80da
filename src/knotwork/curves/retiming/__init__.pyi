from .clock import SpeedOverride as SpeedOverride
from .clock import make_override as make_override
from .composition import approximate_by_cubics as approximate_by_cubics
from .composition import compose as compose
from .stops import find_first_rest as find_first_rest
from .stops import keeps_joint_limits as keeps_joint_limits
from .stops import stop_joints as stop_joints
from .stops import stop_on_path as stop_on_path
