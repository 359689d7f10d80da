from .load import load_robot as load_robot
from .load import robot_names as robot_names
from .model import Robot as Robot
