"""The numbers of robot, table and puck, as the simulator has them. SI units, radians.

Written by `faceoff sim export --format python`; a test compares it with what the program writes.
"""

from typing import Final

# The arm: joints and links, base to tip.
# driven joints
JOINTS: Final = 7
# each joint in its parent's frame
LINK_OFFSET_M: Final = (
    (0.0, 0.0, 0.1575),
    (0.0, 0.0, 0.2025),
    (0.0, 0.2045, 0.0),
    (0.0, 0.0, 0.2155),
    (0.0, 0.1845, 0.0),
    (0.0, 0.0, 0.2155),
    (0.0, 0.081, 0.0),
)
# rotation matrix, rows, of each link in its parent at angle 0; each joint turns about its link's z
LINK_MOUNT: Final = (
    ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
)
MASS_KG: Final = (8.240527, 6.357896, 4.042756, 3.642249, 2.580896, 2.760564, 1.285417)
# link's frame
CENTRE_OF_MASS_M: Final = (
    (4.007709e-6, -0.033936, 0.122467),
    (0.003402, 0.034792, 0.046725),
    (-0.001452, 0.031526, 0.133584),
    (-0.002527, 0.053508, 0.037205),
    (0.001855, 0.024573, 0.080131),
    (-0.001739, -0.001973, -0.002502),
    (0.000735, 0.000387, 0.02646),
)
# about the centre of mass, link's axes: xx, yy, zz, xy, xz, yz
INERTIA_KG_M2: Final = (
    (0.021981, 0.022182, 0.008234, -2.897243e-7, 6.3165236e-7, 0.003285),
    (0.015565, 0.00518, 0.015484, -4.147301e-6, 1.192255e-5, 0.002538),
    (0.010914, 0.010381, 0.003139, -3.540575e-6, -9.059062e-6, -0.002128),
    (0.007536, 0.002538, 0.007206, -5.707028e-6, 2.781894e-6, 0.001256),
    (0.005201, 0.004488, 0.002242, 1.089316e-7, 9.035623e-7, -0.001613),
    (0.002534, 0.001821, 0.002393, -1.311766e-6, 9.508242e-7, 0.000134),
    (0.000151, 0.00015, 0.000187, -7.2231e-8, 2.038333e-6, -3.39683e-7),
)
# ±, the physical stop
POSITION_LIMIT_RAD: Final = (2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433)
# ±
VELOCITY_LIMIT_RAD_S: Final = (1.4835298641951802, 1.4835298641951802, 1.7453292519943295, 1.3089969389957472, 2.2689280275926285, 2.356194490192345, 2.356194490192345)
# ±, as the protocol's message `hello` states it
ACCELERATION_LIMIT_RAD_S2: Final = (14.835298641951802, 14.835298641951802, 17.453292519943297, 13.089969389957473, 22.689280275926286, 23.561944901923447, 23.561944901923447)
# ±, the controller's clamp
TORQUE_LIMIT_N_M: Final = (320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0)
# viscous
DAMPING_N_M_S: Final = (0.33032, 0.21216, 0.1, 0.219041, 0.185923, 0.1, 0.1)
# ±
DRY_FRICTION_N_M: Final = (0.384477, 0.496333, 0.173951, 0.3751, 0.481099, 0.196149, 0.299238)
# rotors
ARMATURE_KG_M2: Final = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01)
# controller, per rad
KP_N_M: Final = (1500.0, 1500.0, 1200.0, 1200.0, 1000.0, 1000.0, 500.0)
# controller, per rad/s
KD_N_M_S: Final = (60.0, 80.0, 60.0, 30.0, 10.0, 1.0, 0.5)
# the rules count positions and velocities beyond this share of a limit
LIMIT_FRACTION: Final = 0.95
# a commanded joint nears its stop no faster than this times the distance
LIMITER_GAIN_PER_S: Final = 20.0
# joint positions at the start of an episode, rad
START_Q: Final = (0.0, -0.196067345, 0.0, -1.84363898, 0.0, 0.970422238, 0.0)
# angles of the universal joint in that pose, mallet vertical
START_UNIVERSAL_RAD: Final = (0.52359878059, 0.0)

# The tool: on link 7 the end effector, on it by the universal joint the mallet.
# along link 7's z
END_EFFECTOR_Z_M: Final = 0.585
END_EFFECTOR_MASS_KG: Final = 0.1
# about every axis
END_EFFECTOR_INERTIA_KG_M2: Final = 0.001
MALLET_MASS_KG: Final = 0.283
# along the mallet's z
MALLET_CENTRE_OF_MASS_Z_M: Final = 0.0682827
# about every axis
MALLET_INERTIA_KG_M2: Final = 0.005
# centre of the cylinder that touches the puck, along the mallet's z
MALLET_CYLINDER_Z_M: Final = 0.0505
MALLET_RADIUS_M: Final = 0.04815
MALLET_HALF_HEIGHT_M: Final = 0.03
# controller, per rad
UNIVERSAL_KP_N_M: Final = 4.0
# controller, per rad/s
UNIVERSAL_KD_N_M_S: Final = 0.31
# ±
UNIVERSAL_TORQUE_LIMIT_N_M: Final = 10.0
# ±, of its desired angles
UNIVERSAL_RANGE_RAD: Final = 1.4922565104551517
# weight of the newest hinge velocity in its low-pass filter, per substep
UNIVERSAL_FILTER_NEW: Final = 0.273

# Where the mallet has to be, in the robot's base frame.
# of the end effector
EE_DESIRED_HEIGHT_M: Final = 0.1645
# ±
EE_HEIGHT_TOLERANCE_M: Final = 0.02
# least height of the origins of links 4 (elbow) and 7 (wrist)
LINK_HEIGHT_M: Final = 0.25

# Table and puck.
# from the base to the table's centre, along x
BASE_X_M: Final = 1.51
# height of the base above the table's surface
BASE_Z_M: Final = -0.1
# goal line to goal line
TABLE_LENGTH_M: Final = 1.948
TABLE_WIDTH_M: Final = 1.038
GOAL_WIDTH_M: Final = 0.25
PUCK_RADIUS_M: Final = 0.03165
PUCK_MASS_KG: Final = 0.01
PUCK_YAW_INERTIA_KG_M2: Final = 5e-6
# viscous
PUCK_DAMPING_N_S_M: Final = 0.005
# viscous
PUCK_YAW_DAMPING_N_M_S: Final = 2e-6
PUCK_HEIGHT_M: Final = 0.02

# Time and gravity.
# one action
CONTROL_STEP_S: Final = 0.02
# one step of controller and physics
SUBSTEP_S: Final = 0.001
# in a control step
SUBSTEPS: Final = 20
# along −z
GRAVITY_M_S2: Final = 9.81
