//! Contact detection between puck, mallets and *rims* (the walls around the table, interrupted by the goals), with the library rapier.
//!
//! A cheap test, the *broad phase*, excludes pairs that are far apart. Rims, puck and mallets are rapier colliders; rapier's queries find
//! normals and depths of the overlaps. All contacts are in the plane of the surface, where a ball between high walls represents a disc
//! exactly. A leaning mallet is cut at the heights where it can touch first. The rounding of the goal posts
//! is a contact skin around sharp-edged cuboids, which is the same set of points. The queries are pure
//! functions of the poses, so that a saved world does not contain them. All positions are in the table frame.
//!
//! Only this module uses rapier's math types.

use super::{
    geometry::{PUCK, TABLE},
    mallet_cylinder::{LARGEST_REACH_M, MalletCylinder},
};
use rapier3d_f64::{
    geometry::{Collider, ColliderBuilder},
    math::{Pose, Vector},
    parry::{
        query,
        shape::{Ball, Shape},
    },
};
use std::sync::LazyLock;

/// A contact: an overlap of two bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint {
    /// Unit normal, into the second body.
    pub normal: [f64; 3],
    /// Depth of the overlap, m, positive.
    pub depth_m: f64,
    /// Point of action of the force, m; its height is 0 if only the puck takes part.
    pub point: [f64; 3],
    /// Distance of `point` from the second body's centre, m.
    pub lever_m: f64,
}

/// The rims, which never move (two long ones, and the four short ones beside the goals), and the puck.
struct Colliders {
    long_rims: [Collider; 2],
    short_rims: [Collider; 4],
    puck: Collider,
}

/// Half the height of the walls, m: any height above the discs' radii gives the same contacts.
const WALL_HALF_HEIGHT_M: f64 = 1.0;

static COLLIDERS: LazyLock<Colliders> = LazyLock::new(|| {
    // All lengths in m.
    let half_thickness = TABLE.rim_thickness_m / 2.0;
    let skin = TABLE.post_radius_m;
    let (half_length, half_width) = (TABLE.half_length_m(), TABLE.half_width_m());
    let outer_x = half_length + TABLE.rim_thickness_m;
    let long_rim = |side: f64| {
        ColliderBuilder::cuboid(outer_x, half_thickness, WALL_HALF_HEIGHT_M)
            .translation(Vector::new(0.0, side * (half_width + half_thickness), 0.0))
            .build()
    };
    // A short rim extends along y from the centre of its post's rounding to the outer face of the long rim, which covers that end.
    let (post_y, end_y) = (
        TABLE.goal_width_m / 2.0 + skin,
        half_width + TABLE.rim_thickness_m - skin,
    );
    let short_rim = |end: f64, side: f64| {
        ColliderBuilder::cuboid(
            half_thickness - skin,
            (end_y - post_y) / 2.0,
            WALL_HALF_HEIGHT_M,
        )
        .contact_skin(skin)
        .translation(Vector::new(
            end * (half_length + half_thickness),
            side * (post_y + end_y) / 2.0,
            0.0,
        ))
        .build()
    };
    Colliders {
        long_rims: [long_rim(1.0), long_rim(-1.0)],
        short_rims: [
            short_rim(1.0, 1.0),
            short_rim(1.0, -1.0),
            short_rim(-1.0, 1.0),
            short_rim(-1.0, -1.0),
        ],
        puck: ColliderBuilder::ball(PUCK.radius_m).build(),
    }
});

/// Overlap of two shapes, the first one thickened by a skin (m): unit normal towards the second one,
/// and depth, m.
fn overlap(
    (first, first_pose): (&dyn Shape, Pose),
    skin: f64,
    (second, second_pose): (&dyn Shape, Pose),
) -> Option<([f64; 2], f64)> {
    // Every pair is a ball with a ball or a cuboid, which the query supports.
    let contact = query::contact(&first_pose, first, &second_pose, second, skin).ok()??;
    let depth_m = skin - contact.dist;
    (depth_m > 0.0).then_some(([contact.normal1.x, contact.normal1.y], depth_m))
}

/// Contact of the puck with a rim. The force acts at the middle of the overlap.
fn rim_and_puck(rim: &Collider, puck: [f64; 2]) -> Option<ContactPoint> {
    let (n, depth_m) = overlap(
        (rim.shape(), *rim.position()),
        rim.contact_skin(),
        (COLLIDERS.puck.shape(), pose_at(puck)),
    )?;
    let lever_m = PUCK.radius_m - 0.5 * depth_m;
    Some(ContactPoint {
        normal: [n[0], n[1], 0.0],
        depth_m,
        point: [puck[0] - lever_m * n[0], puck[1] - lever_m * n[1], 0.0],
        lever_m,
    })
}

/// Contact of two discs, given by centre and radius, at a `height` (m) above the surface. The point of action divides the line between
/// the centres in proportion to the radii.
fn discs(
    (first, first_radius): ([f64; 2], f64),
    (second, second_radius): ([f64; 2], f64),
    height: f64,
) -> Option<ContactPoint> {
    let reach = first_radius + second_radius;
    are_within(first, second, reach).then_some(())?;
    let balls = [first_radius, second_radius].map(Ball::new);
    let (n, depth_m) = overlap(
        (&balls[0], pose_at(first)),
        0.0,
        (&balls[1], pose_at(second)),
    )?;
    let lever_m = second_radius * (1.0 - depth_m / reach);
    Some(ContactPoint {
        normal: [n[0], n[1], 0.0],
        depth_m,
        point: [
            second[0] - lever_m * n[0],
            second[1] - lever_m * n[1],
            height,
        ],
        lever_m,
    })
}

fn pose_at(position: [f64; 2]) -> Pose {
    Pose::from_translation(Vector::new(position[0], position[1], 0.0))
}

/// Builds the table's colliders, once per process, so that no substep does it.
pub fn build_colliders() {
    LazyLock::force(&COLLIDERS);
}

/// The broad phase of the rims: may the puck touch a long rim, and may it touch a short one?
#[inline(always)]
fn near_long_and_short_rims(puck: [f64; 2]) -> [bool; 2] {
    [
        puck[1].abs() + PUCK.radius_m > TABLE.half_width_m(),
        puck[0].abs() + PUCK.radius_m > TABLE.half_length_m(),
    ]
}

/// May the puck touch a rim?
#[inline(always)]
pub fn near_rims(puck: [f64; 2]) -> bool {
    near_long_and_short_rims(puck) != [false; 2]
}

/// Calls `add` for each contact of the puck with a rim; there are at most two at a time, in a corner.
pub fn for_each_rim_contact(puck: [f64; 2], mut add: impl FnMut(ContactPoint)) {
    let [near_long, near_short] = near_long_and_short_rims(puck);
    if !near_long && !near_short {
        return;
    }
    // Indices into the arrays of rims, which begin with y > 0 and x > 0.
    let [negative_y, negative_x] = [puck[1] < 0.0, puck[0] < 0.0].map(usize::from);
    if near_long {
        rim_and_puck(&COLLIDERS.long_rims[negative_y], puck).map(&mut add);
    }
    if near_short {
        rim_and_puck(&COLLIDERS.short_rims[2 * negative_x + negative_y], puck).map(&mut add);
    }
}

/// The broad phase of a mallet, given by its centre (m), and the puck.
#[inline(always)]
pub fn mallet_near_puck([x, y, _]: [f64; 3], puck: [f64; 2]) -> bool {
    are_within([x, y], puck, LARGEST_REACH_M + PUCK.radius_m)
}

/// The broad phase of two mallets, given by their centres (m).
#[inline(always)]
pub fn mallets_near([x_1, y_1, _]: [f64; 3], [x_2, y_2, _]: [f64; 3]) -> bool {
    are_within([x_1, y_1], [x_2, y_2], 2.0 * LARGEST_REACH_M)
}

/// Contact of a mallet with the puck, normal into the puck. A leaning cylinder touches the puck first at
/// the puck's upper or lower edge, and pushes perpendicular to its axis.
pub fn mallet_and_puck(mallet: &MalletCylinder, puck: [f64; 2]) -> Option<ContactPoint> {
    if !mallet_near_puck(mallet.centre, puck) {
        return None;
    }
    let [low, high] = mallet.heights();
    deepest_of([low.max(0.0), high.min(PUCK.height_m)], |z| {
        let axis = mallet.axis_at(z);
        let reach = mallet.reach([puck[0] - axis[0], puck[1] - axis[1]]);
        let contact = discs((axis, reach), (puck, PUCK.radius_m), z)?;
        Some(ContactPoint {
            normal: mallet.side_normal(contact.normal),
            ..contact
        })
    })
}

/// Contact of the two mallets, normal into the second.
pub fn mallets(first: &MalletCylinder, second: &MalletCylinder) -> Option<ContactPoint> {
    if !mallets_near(first.centre, second.centre) {
        return None;
    }
    let ([low_1, high_1], [low_2, high_2]) = (first.heights(), second.heights());
    deepest_of([low_1.max(low_2), high_1.min(high_2)], |z| {
        let (a, b) = (first.axis_at(z), second.axis_at(z));
        let direction = [b[0] - a[0], b[1] - a[1]];
        discs((a, first.reach(direction)), (b, second.reach(direction)), z)
    })
}

/// The deeper contact at the two ends of a range of heights; `None` if the range is empty.
fn deepest_of(
    [low, high]: [f64; 2],
    contact: impl Fn(f64) -> Option<ContactPoint>,
) -> Option<ContactPoint> {
    if low >= high {
        return None;
    }
    match (contact(low), contact(high)) {
        (Some(a), Some(b)) if b.depth_m > a.depth_m => Some(b),
        (a, b) => a.or(b),
    }
}

/// Are two points closer than `distance`?
#[inline(always)]
fn are_within(a: [f64; 2], b: [f64; 2], distance: f64) -> bool {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    dx * dx + dy * dy < distance * distance
}
