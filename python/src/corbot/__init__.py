# SPDX-License-Identifier: Apache-2.0
"""A client of robot arms: `arm = corbot.connect("lynx5")`, then `arm.move(0.20, 0.05, 0.08)`.

Metres, degrees, seconds and percent everywhere.
"""

from corbot.arm import Arm, connect
from corbot.camera import Camera, serve_camera
from corbot.cell import Cell, Frame, PieceEvent, Place, RobotWork, Sighting, Spot, Step, Work, cell
from corbot.errors import (
    BadAddress,
    BadParameter,
    CellNotFound,
    CorbotError,
    Disconnected,
    LimitExceeded,
    MotionTimeout,
    NoAnswer,
    NoControl,
    NotOffered,
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
from corbot.simulation import CellSimulation, Simulation, simulated, simulated_cell
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
    "Camera",
    "Cell",
    "CellNotFound",
    "CellSimulation",
    "Control",
    "CorbotError",
    "Device",
    "Diagnostics",
    "Disconnected",
    "Frame",
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
    "NotOffered",
    "NotReady",
    "OrbError",
    "PieceEvent",
    "Place",
    "Point",
    "Pose",
    "Quaternion",
    "QueueFull",
    "Recording",
    "RobotNotFound",
    "RobotWork",
    "Servant",
    "Sighting",
    "Simulation",
    "SimulationFailed",
    "Solution",
    "Speeds",
    "Spot",
    "State",
    "States",
    "Status",
    "Step",
    "Stopped",
    "Unreachable",
    "Work",
    "cell",
    "connect",
    "record",
    "serve_camera",
    "simulated",
    "simulated_cell",
]
