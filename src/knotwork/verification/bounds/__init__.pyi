from .adaptive import Bound as Bound
from .effort import effort_bound as effort_bound
from .effort import torque_bound as torque_bound
from .tool_motion import singular_value_bound as singular_value_bound
from .tool_motion import tool_acceleration_bound as tool_acceleration_bound
from .tool_motion import tool_speed_bound as tool_speed_bound
