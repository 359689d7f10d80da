from .result import Bound as Bound
from .singular import singular_value_bound as singular_value_bound
from .tool import tool_acceleration_bound as tool_acceleration_bound
from .tool import tool_angle_bound as tool_angle_bound
from .tool import tool_distance_bound as tool_distance_bound
from .tool import tool_speed_bound as tool_speed_bound
from .tool import tool_turning_bound as tool_turning_bound
from .torque import torque_bound as torque_bound
