from .inserted import knots_of as knots_of
from .solution import Choice as Choice
from .solution import PathStart as PathStart
from .solution import SequenceStep as SequenceStep
from .solution import TaskSolution as TaskSolution
from .solve import solve_task as solve_task
