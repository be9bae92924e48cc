//! Finds the contacts of a substep between mallets, puck and *rims* (the walls around the table). A cheap test, the *broad phase*, excludes
//! most substeps.

use super::contacts::{Contacts, MalletMotion, Pair};
use crate::{
    dynamics::spatial::{Motion, Vec3},
    model::DOFS,
    table::{
        contact_finder::{self, ContactPoint},
        contact_law::{MALLET, MALLETS, RIM},
        frames::{axis_sign, robot_from_table, table_from_robot},
        mallet_cylinder::MalletCylinder,
        puck::Puck,
    },
};

/// Pose of a robot's mallet, in the robot's base frame.
#[derive(Debug, Clone, Copy)]
pub struct MalletPose {
    /// Centre of the striking cylinder, m.
    pub centre: [f64; 3],
    /// Unit vector along the mallet's axis.
    pub axis: [f64; 3],
}

/// Broad phase: whether mallets, puck or rims may be in contact. `centres` are those of the mallets' cylinders, m,
/// the robots' base frames.
#[inline(always)]
pub fn may_touch(centres: &[[f64; 3]], puck: &Puck) -> bool {
    let puck_xy = [puck.pose[0], puck.pose[1]];
    let centre = |robot: usize| table_from_robot(robot, centres[robot]);
    let both_mallets = match centres.len() {
        2 => contact_finder::mallets_near(centre(0), centre(1)),
        _ => false,
    };
    let mallet_and_puck =
        (0..centres.len()).any(|robot| contact_finder::mallet_near_puck(centre(robot), puck_xy));
    both_mallets || mallet_and_puck || contact_finder::near_rims(puck_xy)
}

/// The contacts of a substep; `None` if there are none. `motion` returns a robot's joint axes, in its base frame,
/// and its joint velocities (rad/s).
#[cold]
pub fn find_contacts(
    mallets: &[MalletPose],
    motion: impl Fn(usize) -> ([Motion<f64>; DOFS], [f64; DOFS]),
    puck: &Puck,
) -> Option<Contacts> {
    let puck_xy = [puck.pose[0], puck.pose[1]];
    let cylinder = |robot: usize| {
        let ([x, y, z], sign) = (mallets[robot].axis, axis_sign(robot));
        let centre = table_from_robot(robot, mallets[robot].centre);
        MalletCylinder::along(centre, [sign * x, sign * y, z])
    };
    let puck_contacts: [Option<ContactPoint>; 2] = std::array::from_fn(|robot| {
        (robot < mallets.len())
            .then(|| contact_finder::mallet_and_puck(&cylinder(robot), puck_xy))
            .flatten()
    });
    let between_mallets = (mallets.len() == 2)
        .then(|| contact_finder::mallets(&cylinder(0), &cylinder(1)))
        .flatten();
    let mallets_touch = between_mallets.is_some() || puck_contacts != [None, None];
    if !mallets_touch && !contact_finder::near_rims(puck_xy) {
        return None;
    }
    let mut contacts = Contacts::none();
    add_rims(&mut contacts, puck);
    if !mallets_touch {
        return (!contacts.is_empty()).then_some(contacts);
    }
    let mallet_motion = |robot: usize, contact: &ContactPoint| {
        let sign = axis_sign(robot);
        let [x, y, z] = robot_from_table(robot, contact.point);
        let (axes, dq) = motion(robot);
        let jacobian = axes.map(|axis| axis.velocity_at(Vec3::new(x, y, z)));
        // In the table frame.
        let rows: [[f64; DOFS]; 3] = [
            jacobian.map(|column| sign * column.x),
            jacobian.map(|column| sign * column.y),
            jacobian.map(|column| column.z),
        ];
        let velocity = rows.map(|row| (0..DOFS).map(|i| row[i] * dq[i]).sum());
        MalletMotion {
            jacobian: Some(rows),
            velocity,
        }
    };
    for (robot, contact) in puck_contacts.into_iter().enumerate() {
        if let Some(contact) = contact {
            let pair = Pair::Mallet {
                robot,
                mallet: &mallet_motion(robot, &contact),
                puck_velocity: &puck.velocity,
            };
            contacts.add(contact, &MALLET, pair);
        }
    }
    if let Some(contact) = between_mallets {
        let mallets = [&mallet_motion(0, &contact), &mallet_motion(1, &contact)];
        contacts.add(contact, &MALLETS, Pair::Mallets { mallets });
    }
    Some(contacts)
}

/// Adds the contacts of the puck with the rims.
pub fn add_rims(contacts: &mut Contacts, puck: &Puck) {
    contact_finder::for_each_rim_contact([puck.pose[0], puck.pose[1]], |contact| {
        let pair = Pair::Rim {
            puck_velocity: &puck.velocity,
        };
        contacts.add(contact, &RIM, pair);
    });
}
