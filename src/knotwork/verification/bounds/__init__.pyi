from .adaptive import Bound as Bound
from .frame_speed import tool_acceleration_bound as tool_acceleration_bound
from .frame_speed import tool_speed_bound as tool_speed_bound
from .singular import singular_value_bound as singular_value_bound
from .torque import torque_bound as torque_bound
