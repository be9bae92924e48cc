//! The physical world: a puck, and one or two arms around it.

mod arm;
mod contacts;
mod joints;

use crate::{
    dynamics::{
        arm::{Bodies, Kinematics, controller_torques, damped, mass_matrix, plant_bias},
        factor::Factor,
        lanes::Lanes,
    },
    robot::{
        controller::{filter_velocity, torque},
        interpolation::Interpolation,
        model::{DOFS, INITIAL_Q, JOINTS, SUBSTEP_S, SUBSTEPS, TOOL},
        plant::Plant,
    },
    table::{
        contact_finder,
        contact_law::{MALLET, MALLETS, RIM},
        geometry::{PUCK, TABLE},
        puck::Puck,
    },
};
pub use arm::Arm;
use contacts::{ContactForces, Contacts, MalletMotion, Pair};
use wide::f64x2;

/// Full corrections of the set of joint constraints at their bounds; afterwards one at a time, which
/// cannot cycle between two wrong sets, up to the second number.
const FULL_CORRECTIONS: usize = 8;
const CORRECTIONS: usize = 40;

/// A mallet's striking cylinder: centre x, y, z (m) and velocity vx, vy (m/s), table frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MalletState {
    /// m.
    pub position: [f64; 3],
    /// m/s.
    pub velocity: [f64; 2],
}

/// Puck and arms, advanced by one millisecond at a time. Clone saves a world exactly.
#[derive(Debug, Clone)]
pub struct World {
    plant: Plant,
    arms: Vec<Arm>,
    puck: Puck,
    /// Robot 1's mallet, when it is imposed in place of being moved by an arm.
    imposed: Option<MalletState>,
    imposed_acceleration: [f64; 2],
    /// Force of the air on the puck, N.
    air_n: [f64; 2],
    /// Index of the next substep within the control step.
    substep: usize,
}

impl World {
    /// A world of one arm per initial joint position (at most two), all at rest, and a puck at
    /// [x, y, yaw, vx, vy, yaw rate] in the table frame.
    #[must_use]
    pub fn new(plant: &Plant, joints: &[[f64; JOINTS]], puck: [f64; 6]) -> Self {
        debug_assert!(joints.len() <= 2);
        Self {
            plant: plant.clone(),
            arms: joints.iter().take(2).map(|q| Arm::new(plant, q)).collect(),
            puck: Puck::from_state(puck),
            imposed: None,
            imposed_acceleration: [0.0; 2],
            air_n: [0.0; 2],
            substep: 0,
        }
    }

    /// A world of `robots` arms in their initial pose.
    #[must_use]
    pub fn with_robots(plant: &Plant, robots: usize, puck: [f64; 6]) -> Self {
        Self::new(plant, &[INITIAL_Q; 2][..robots.min(2)], puck)
    }

    /// Gives a robot (0 or 1) its action for the coming control step: row-major, of length
    /// [`Interpolation::len`].
    pub fn command(&mut self, robot: usize, interpolation: Interpolation, action: &[f64]) {
        self.arms[robot].command(interpolation, action);
    }

    /// Imposes the motion of robot 1's mallet from now on, or frees it. With an imposed mallet
    /// robot 1's arm stays where it is.
    pub fn impose_mallet(&mut self, mallet: Option<MalletState>) {
        self.imposed = mallet;
    }

    /// Sets the force of the air on the puck, N.
    pub fn set_air_force(&mut self, force_n: [f64; 2]) {
        self.air_n = force_n;
    }

    /// Number of arms.
    #[must_use]
    pub fn robots(&self) -> usize {
        self.arms.len()
    }

    /// The puck: [x, y, yaw, vx, vy, yaw rate], table frame.
    #[must_use]
    pub fn puck(&self) -> &Puck {
        &self.puck
    }

    /// Puts the puck somewhere else.
    pub fn set_puck(&mut self, puck: [f64; 6]) {
        self.puck = Puck::from_state(puck);
    }

    /// Positions of a robot's driven joints, rad.
    #[must_use]
    pub fn joints(&self, robot: usize) -> [f64; JOINTS] {
        head(&self.arms[robot].q)
    }

    /// True velocities of a robot's driven joints, rad/s.
    #[must_use]
    pub fn joint_velocities(&self, robot: usize) -> [f64; JOINTS] {
        head(&self.arms[robot].dq)
    }

    /// Low-pass filtered velocities of a robot's driven joints, rad/s.
    #[must_use]
    pub fn filtered_velocities(&self, robot: usize) -> &[f64; JOINTS] {
        &self.arms[robot].dq_filtered
    }

    /// Angles of a robot's universal joint, rad.
    #[must_use]
    pub fn universal(&self, robot: usize) -> [f64; 2] {
        let q = &self.arms[robot].q;
        [q[7], q[8]]
    }

    /// Torques applied in the last substep, N m.
    #[must_use]
    pub fn torques(&self, robot: usize) -> &[f64; JOINTS] {
        &self.arms[robot].torque
    }

    /// A robot's forward kinematics, in its own base frame.
    #[must_use]
    pub fn kinematics(&self, robot: usize) -> Kinematics<f64> {
        Kinematics::new(&self.arms[robot].q)
    }

    /// A robot's end effector before the last substep, m, its own base frame: what the reference's
    /// observation of the opponent shows.
    #[must_use]
    pub fn end_effector_before(&self, robot: usize) -> [f64; 3] {
        self.arms[robot].ee_before
    }

    /// A robot's mallet.
    #[must_use]
    pub fn mallet(&self, robot: usize) -> MalletState {
        if let (0, Some(mallet)) = (robot, self.imposed) {
            return mallet;
        }
        let kinematics = self.kinematics(robot);
        let centre = kinematics.cylinder_centre();
        let jacobian = kinematics.jacobian_at(centre);
        let arm = &self.arms[robot];
        let (mut vx, mut vy) = (0.0, 0.0);
        for i in 0..DOFS {
            vx += jacobian[i].x * arm.dq[i];
            vy += jacobian[i].y * arm.dq[i];
        }
        let side = side(robot);
        MalletState {
            position: table_from_robot(robot, centre.lane(0)),
            velocity: [side * vx, side * vy],
        }
    }

    /// Advances by a control step, 20 substeps. `air` is called before each of them.
    pub fn control_step(&mut self, mut air: impl FnMut(&Puck) -> [f64; 2]) {
        for _ in 0..SUBSTEPS {
            self.air_n = air(&self.puck);
            self.substep();
        }
    }

    /// Advances by one substep, 1 ms. After 20 of them a new action is due; without one the last
    /// trajectory would be repeated, so [`World::command`] or [`World::hold`] first.
    pub fn substep(&mut self) {
        if self.imposed.is_some() {
            self.substep_imposed();
        } else {
            match self.arms.len() {
                0 => self.advance_puck_alone(),
                1 => self.substep_lanes::<f64>(),
                _ => self.substep_lanes::<f64x2>(),
            }
        }
        self.substep = (self.substep + 1) % SUBSTEPS;
    }

    /// Lets a robot hold the end of its last trajectory at rest.
    pub fn hold(&mut self, robot: usize) {
        self.arms[robot].hold();
    }

    fn advance_puck_alone(&mut self) {
        let mut contacts = Contacts::none();
        self.add_rims(&mut contacts);
        let forces = if contacts.is_empty() {
            None
        } else {
            let free = self.puck.free_acceleration(self.air_n);
            Some(contacts.solve(&free, &[[0.0; DOFS]; 2], |_, torque| *torque))
        };
        self.advance_puck(forces.map(|forces| forces.puck));
    }

    fn substep_imposed(&mut self) {
        let mut contacts = Contacts::none();
        self.add_rims(&mut contacts);
        if let Some(mallet) = self.imposed {
            let [x, y, z] = mallet.position;
            if meets_puck(z)
                && let Some(touch) =
                    contact_finder::mallet_and_puck([x, y], [self.puck.pose[0], self.puck.pose[1]])
            {
                let motion = MalletMotion {
                    jacobian: None,
                    velocity: mallet.velocity,
                    acceleration: self.imposed_acceleration,
                };
                contacts.add(
                    touch,
                    &MALLET,
                    Pair::Mallet {
                        robot: 0,
                        mallet: &motion,
                        puck: &self.puck.velocity,
                    },
                );
            }
        }
        let forces = if contacts.is_empty() {
            None
        } else {
            let free = self.puck.free_acceleration(self.air_n);
            Some(contacts.solve(&free, &[[0.0; DOFS]; 2], |_, torque| *torque))
        };
        self.advance_puck(forces.map(|forces| forces.puck));
    }

    fn add_rims(&self, contacts: &mut Contacts) {
        contact_finder::rims([self.puck.pose[0], self.puck.pose[1]], |touch| {
            contacts.add(
                touch,
                &RIM,
                Pair::Rim {
                    puck: &self.puck.velocity,
                },
            );
        });
    }

    fn advance_puck(&mut self, contact: Option<[f64; 3]>) {
        let mut force = [self.air_n[0], self.air_n[1], 0.0];
        if let Some(contact) = contact {
            for i in 0..3 {
                force[i] += contact[i];
            }
        }
        self.puck.advance(force);
    }

    /// One substep of all arms, `T::COUNT` of them, and the puck.
    fn substep_lanes<T: Lanes>(&mut self) {
        let arms = &mut self.arms;
        let plant = &self.plant;
        let q: [T; DOFS] = std::array::from_fn(|i| T::from_fn(|a| arms[a].q[i]));
        let dq: [T; DOFS] = std::array::from_fn(|i| T::from_fn(|a| arms[a].dq[i]));
        let dq_filtered: [T; JOINTS] =
            std::array::from_fn(|i| T::from_fn(|a| arms[a].dq_filtered[i]));
        let ddq: [T; JOINTS] = std::array::from_fn(|i| {
            T::from_fn(|a| arms[a].trajectory[self.substep].acceleration[i])
        });

        // One forward pass serves controller and plant.
        let kinematics = Kinematics::new(&q);
        let bodies = Bodies::new(&kinematics);
        let feed_forward =
            controller_torques(&kinematics, &bodies.controller(), &dq_filtered, &ddq);
        let bodies = bodies.plant(&plant.mass_scale);
        let bias = plant_bias(&kinematics, &bodies, &dq);
        let mass = mass_matrix(&kinematics, &bodies);

        // Torques of the controllers, less bias and damping.
        let mut load = [[0.0; DOFS]; 2];
        for (a, arm) in arms.iter_mut().enumerate() {
            let command = arm.limiter.limit(&arm.trajectory[self.substep]);
            let feed_forward = std::array::from_fn(|i| feed_forward[i].lane(a));
            arm.torque = torque(plant, &command, &arm.q, &arm.dq_filtered, &feed_forward);
            let ee = &kinematics.end_effector;
            let universal = arm.universal.torque(
                ee.x.lane(a),
                ee.y.lane(a),
                [arm.q[7], arm.q[8]],
                [arm.dq[7], arm.dq[8]],
            );
            for i in 0..JOINTS {
                load[a][i] = arm.torque[i] - bias[i].lane(a) - plant.damping[i] * arm.dq[i];
            }
            for i in 0..2 {
                load[a][7 + i] = universal[i] - bias[7 + i].lane(a);
            }
            arm.constraints.prepare(plant, &arm.q, &arm.dq);
            arm.ee_before = ee.origin.lane(a);
        }

        // Friction, stops and contacts.
        let contacts = find_contacts(&kinematics, &dq, &self.puck);
        let mut puck_force = None;
        match contacts {
            None => {
                let torques = joint_torques::<T>(arms, &mass, &load);
                for (load, torques) in load.iter_mut().zip(torques) {
                    add(load, &torques);
                }
            }
            Some(contacts) => {
                let free = self.puck.free_acceleration(self.air_n);
                let (torques, forces) = contact_torques::<T>(arms, &mass, &load, &contacts, &free);
                for (a, load) in load.iter_mut().enumerate() {
                    add(load, &torques[a]);
                    add(load, &forces.arms[a]);
                }
                puck_force = Some(forces.puck);
            }
        }

        // Semi-implicit Euler, joint damping implicit.
        let load: [T; DOFS] = std::array::from_fn(|i| T::from_fn(|a| load[a][i]));
        let acceleration = Factor::new(&damped(&mass, &plant.damping)).solve(&load);
        for (a, arm) in arms.iter_mut().enumerate() {
            for i in 0..DOFS {
                arm.dq[i] += SUBSTEP_S * acceleration[i].lane(a);
                arm.q[i] += SUBSTEP_S * arm.dq[i];
            }
            filter_velocity(&mut arm.dq_filtered, &arm.dq);
        }
        self.advance_puck(puck_force);
    }
}

/// Contacts of this substep, `None` where nothing touches.
#[inline(always)]
fn find_contacts<T: Lanes>(
    kinematics: &Kinematics<T>,
    dq: &[T; DOFS],
    puck: &Puck,
) -> Option<Contacts> {
    let centre = kinematics.cylinder_centre();
    let puck_xy = [puck.pose[0], puck.pose[1]];
    let positions: [[f64; 3]; 2] = std::array::from_fn(|a| {
        if a < T::COUNT {
            table_from_robot(a, centre.lane(a))
        } else {
            [0.0; 3]
        }
    });
    let touches: [Option<_>; 2] = std::array::from_fn(|a| {
        let [x, y, z] = positions[a];
        if a < T::COUNT && meets_puck(z) {
            contact_finder::mallet_and_puck([x, y], puck_xy)
        } else {
            None
        }
    });
    let between_mallets = if T::COUNT == 2
        && (positions[0][2] - positions[1][2]).abs() < 2.0 * TOOL.cylinder_half_height_m
    {
        contact_finder::mallets(
            [positions[0][0], positions[0][1]],
            [positions[1][0], positions[1][1]],
        )
    } else {
        None
    };
    let mut contacts = Contacts::none();
    contact_finder::rims(puck_xy, |touch| {
        contacts.add(
            touch,
            &RIM,
            Pair::Rim {
                puck: &puck.velocity,
            },
        );
    });
    if between_mallets.is_none() && touches == [None, None] {
        return (!contacts.is_empty()).then_some(contacts);
    }
    let jacobian = kinematics.jacobian_at(centre);
    let mallets: [MalletMotion; 2] = std::array::from_fn(|a| {
        let lane = a.min(T::COUNT - 1);
        let side = side(lane);
        let rows: [[f64; DOFS]; 2] = [
            std::array::from_fn(|i| side * jacobian[i].x.lane(lane)),
            std::array::from_fn(|i| side * jacobian[i].y.lane(lane)),
        ];
        let velocity = rows.map(|row| (0..DOFS).map(|i| row[i] * dq[i].lane(lane)).sum());
        MalletMotion {
            jacobian: Some(rows),
            velocity,
            acceleration: [0.0; 2],
        }
    });
    for (robot, touch) in touches.into_iter().enumerate() {
        if let Some(touch) = touch {
            let pair = Pair::Mallet {
                robot,
                mallet: &mallets[robot],
                puck: &puck.velocity,
            };
            contacts.add(touch, &MALLET, pair);
        }
    }
    if let Some(touch) = between_mallets {
        contacts.add(
            touch,
            &MALLETS,
            Pair::Mallets {
                mallets: [&mallets[0], &mallets[1]],
            },
        );
    }
    Some(contacts)
}

/// Torques of friction and stops where nothing touches, all arms at once.
#[inline(always)]
fn joint_torques<T: Lanes>(
    arms: &mut [Arm],
    mass: &[[T; DOFS]; DOFS],
    load: &[[f64; DOFS]; 2],
) -> [[f64; DOFS]; 2] {
    let mut acceleration = [[0.0; DOFS]; 2];
    for round in 0..CORRECTIONS {
        let mut matrix = *mass;
        let mut rhs = [[0.0; DOFS]; 2];
        let mut diagonal = [[0.0; DOFS]; 2];
        for (a, arm) in arms.iter().enumerate() {
            (diagonal[a], rhs[a]) = arm.constraints.assemble();
            add(&mut rhs[a], &load[a]);
        }
        for i in 0..DOFS {
            matrix[i][i] += T::from_fn(|a| diagonal[a][i]);
        }
        let rhs: [T; DOFS] = std::array::from_fn(|i| T::from_fn(|a| rhs[a][i]));
        let solution = Factor::new(&matrix).solve(&rhs);
        let mut changed = false;
        for (a, arm) in arms.iter_mut().enumerate() {
            acceleration[a] = std::array::from_fn(|i| solution[i].lane(a));
            changed |= arm
                .constraints
                .correct(&acceleration[a], round >= FULL_CORRECTIONS);
        }
        if !changed {
            break;
        }
    }
    let mut torques = [[0.0; DOFS]; 2];
    for (a, arm) in arms.iter().enumerate() {
        torques[a] = arm.constraints.torques(&acceleration[a]);
    }
    torques
}

/// Torques of friction and stops together with the contact forces: given the set of joint
/// constraints at their bounds, the contacts see arms whose inertia includes the other ones.
#[cold]
fn contact_torques<T: Lanes>(
    arms: &mut [Arm],
    mass: &[[T; DOFS]; DOFS],
    load: &[[f64; DOFS]; 2],
    contacts: &Contacts,
    puck_acceleration: &[f64; 3],
) -> ([[f64; DOFS]; 2], ContactForces) {
    let mut acceleration = [[0.0; DOFS]; 2];
    let mut forces = ContactForces {
        puck: [0.0; 3],
        arms: [[0.0; DOFS]; 2],
    };
    for round in 0..CORRECTIONS {
        let factors: [Factor<f64>; 2] = std::array::from_fn(|a| {
            let lane = a.min(T::COUNT - 1);
            let mut matrix: [[f64; DOFS]; DOFS] =
                std::array::from_fn(|i| std::array::from_fn(|j| mass[i][j].lane(lane)));
            let (diagonal, mut rhs) = arms[lane].constraints.assemble();
            for i in 0..DOFS {
                matrix[i][i] += diagonal[i];
            }
            add(&mut rhs, &load[lane]);
            let factor = Factor::new(&matrix);
            acceleration[a] = factor.solve(&rhs);
            factor
        });
        forces = contacts.solve(puck_acceleration, &acceleration, |arm, torque| {
            factors[arm].solve(torque)
        });
        let mut changed = false;
        for (a, arm) in arms.iter_mut().enumerate() {
            add(&mut acceleration[a], &factors[a].solve(&forces.arms[a]));
            changed |= arm
                .constraints
                .correct(&acceleration[a], round >= FULL_CORRECTIONS);
        }
        if !changed {
            break;
        }
    }
    let mut torques = [[0.0; DOFS]; 2];
    for (a, arm) in arms.iter().enumerate() {
        torques[a] = arm.constraints.torques(&acceleration[a]);
    }
    (torques, forces)
}

/// A robot's side of the table: its base frame is turned by π for robot 2.
#[inline(always)]
fn side(robot: usize) -> f64 {
    if robot == 0 { 1.0 } else { -1.0 }
}

/// A point of a robot's base frame in the table frame, m.
#[inline(always)]
fn table_from_robot(robot: usize, p: [f64; 3]) -> [f64; 3] {
    let side = side(robot);
    [
        side * (p[0] - TABLE.base_x_m),
        side * p[1],
        p[2] + TABLE.base_z_m,
    ]
}

/// Do a mallet's cylinder, centred at height z (m, table frame), and the puck overlap in height?
#[inline(always)]
fn meets_puck(z: f64) -> bool {
    z - TOOL.cylinder_half_height_m < PUCK.height_m && z + TOOL.cylinder_half_height_m > 0.0
}

#[inline(always)]
fn add(a: &mut [f64; DOFS], b: &[f64; DOFS]) {
    for i in 0..DOFS {
        a[i] += b[i];
    }
}

fn head(q: &[f64; DOFS]) -> [f64; JOINTS] {
    std::array::from_fn(|i| q[i])
}
