"""Learning to fly by what a LiDAR sees, in maps of real places: gymnasium's interfaces, `VectorEnv` and `Env`.

gymnasium is not needed; where it is installed, spaces and base classes are its own.
"""

from .env import Env
from .evaluation import Score, evaluate, reactive, wilson
from .observer import Observer
from .policy import Policy, features, straight
from .tasks import TASKS, Explore, Goal, Hover, Outcome, Race, States, Task
from .vector import AutoresetMode, Lidar, VectorEnv

__all__ = [
    "AutoresetMode",
    "Env",
    "Explore",
    "Goal",
    "Hover",
    "Lidar",
    "Observer",
    "Outcome",
    "Policy",
    "Race",
    "Score",
    "States",
    "TASKS",
    "Task",
    "VectorEnv",
    "evaluate",
    "features",
    "reactive",
    "straight",
    "wilson",
]
