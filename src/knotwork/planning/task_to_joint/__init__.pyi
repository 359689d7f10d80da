from .complete_waypoints import knots_of as knots_of
from .task_solution import Choice as Choice
from .task_solution import SequenceStep as SequenceStep
from .task_solution import TaskSolution as TaskSolution
from .task_solver import solve_task as solve_task
