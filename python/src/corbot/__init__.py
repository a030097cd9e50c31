# SPDX-License-Identifier: Apache-2.0
"""A client of robot arms: `arm = corbot.connect("lynx5")`, then `arm.move(0.20, 0.05, 0.08)`.

Metres, degrees, seconds and percent everywhere.
"""

from corbot.arm import Arm, connect
from corbot.errors import (
    BadAddress,
    BadParameter,
    CorbotError,
    Disconnected,
    LimitExceeded,
    MotionTimeout,
    NoAnswer,
    NoControl,
    NotReady,
    OrbError,
    QueueFull,
    RobotNotFound,
    SimulationFailed,
    Stopped,
    Unreachable,
)
from corbot.model import Joint, Model
from corbot.motion import Motion
from corbot.poses import Point, Pose, Quaternion
from corbot.recording import Recording, record
from corbot.simulation import Simulation, simulated
from corbot.states import States
from corbot.values import (
    Alarm,
    Control,
    Device,
    Diagnostics,
    Frames,
    Gripper,
    Holding,
    JointLimits,
    MotionInfo,
    MotionState,
    Servant,
    Solution,
    Speeds,
    State,
    Status,
)

__all__ = [
    "Alarm",
    "Arm",
    "BadAddress",
    "BadParameter",
    "Control",
    "CorbotError",
    "Device",
    "Diagnostics",
    "Disconnected",
    "Frames",
    "Gripper",
    "Holding",
    "Joint",
    "JointLimits",
    "LimitExceeded",
    "Model",
    "Motion",
    "MotionInfo",
    "MotionState",
    "MotionTimeout",
    "NoAnswer",
    "NoControl",
    "NotReady",
    "OrbError",
    "Point",
    "Pose",
    "Quaternion",
    "QueueFull",
    "Recording",
    "RobotNotFound",
    "Servant",
    "Simulation",
    "SimulationFailed",
    "Solution",
    "Speeds",
    "State",
    "States",
    "Status",
    "Stopped",
    "Unreachable",
    "connect",
    "record",
    "simulated",
]
