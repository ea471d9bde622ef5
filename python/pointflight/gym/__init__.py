"""Learning to fly by what a LiDAR sees, in maps of real places: gymnasium's interfaces, `VectorEnv` and `Env`.

gymnasium is not needed; where it is installed, spaces and base classes are its own.
"""

from .env import Env
from .tasks import TASKS, Goal, Hover, Outcome, States, Task
from .vector import AutoresetMode, Lidar, VectorEnv

__all__ = [
    "AutoresetMode",
    "Env",
    "Goal",
    "Hover",
    "Lidar",
    "Outcome",
    "States",
    "TASKS",
    "Task",
    "VectorEnv",
]
