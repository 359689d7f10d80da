from . import kinematics as kinematics
from .load import load_robot as load_robot
from .load import robot_names as robot_names
from .robot import Robot as Robot
