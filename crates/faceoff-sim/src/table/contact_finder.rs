//! Who touches whom: the boundary to rapier.
//!
//! Table, puck and mallets are rapier colliders; rapier's narrow-phase queries find normals and
//! depths. Everything of interest happens in the plane of the surface, where a disc is represented
//! exactly by a ball that meets walls of any height; overlap in z is the caller's to check. The goal
//! posts' rounding is a contact skin around sharp-edged cuboids, which is the same set of points.
//! The queries are pure functions of the poses, so that a world is saved without them.
//!
//! Rapier's math types end in this module.

use super::geometry::{PUCK, TABLE};
use crate::robot::model::TOOL;
use rapier3d_f64::{
    geometry::{Collider, ColliderBuilder},
    math::{Pose, Vector},
    parry::query,
};
use std::sync::LazyLock;

/// A place where two bodies overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Unit normal in the table frame, into the second body.
    pub normal: [f64; 2],
    /// Depth of the overlap, m, positive.
    pub depth_m: f64,
    /// Middle of the overlap, m, table frame.
    pub point: [f64; 2],
}

/// The table's rims never move: two long ones and the four parts beside the goals.
struct Colliders {
    long_rims: [Collider; 2],
    short_rims: [Collider; 4],
    puck: Collider,
    mallet: Collider,
}

/// Half the height of the walls, m: any height above the discs' radii gives the same contacts.
const WALL_HALF_HEIGHT_M: f64 = 1.0;

static COLLIDERS: LazyLock<Colliders> = LazyLock::new(|| {
    let half_thickness = TABLE.rim_thickness_m / 2.0;
    let skin = TABLE.post_radius_m;
    let (half_length, half_width) = (TABLE.half_length_m(), TABLE.half_width_m());
    let outer_x = half_length + TABLE.rim_thickness_m;
    let long_rim = |side: f64| {
        ColliderBuilder::cuboid(outer_x, half_thickness, WALL_HALF_HEIGHT_M)
            .translation(Vector::new(0.0, side * (half_width + half_thickness), 0.0))
            .build()
    };
    // From the post's centre of rounding to the outer face of the long rim, which hides that end.
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
        mallet: ColliderBuilder::ball(TOOL.cylinder_radius_m).build(),
    }
});

/// Overlap of two colliders, the second one's pose given.
fn touch(first: (&Collider, Pose), second: (&Collider, Pose)) -> Option<Touch> {
    let skin = first.0.contact_skin() + second.0.contact_skin();
    // Every pair is a ball with a ball or a cuboid, which the query supports.
    let contact =
        query::contact(&first.1, first.0.shape(), &second.1, second.0.shape(), skin).ok()??;
    let depth_m = skin - contact.dist;
    // The skins thicken both sides of the gap.
    let middle = (contact.point1 + contact.point2) * 0.5
        + contact.normal1 * (0.5 * (first.0.contact_skin() - second.0.contact_skin()));
    (depth_m > 0.0).then_some(Touch {
        normal: [contact.normal1.x, contact.normal1.y],
        depth_m,
        point: [middle.x, middle.y],
    })
}

fn at(position: [f64; 2]) -> Pose {
    Pose::from_translation(Vector::new(position[0], position[1], 0.0))
}

/// The broad phase of the rims: whether the puck may touch a long, a short one.
#[inline(always)]
fn near(puck: [f64; 2]) -> [bool; 2] {
    [
        puck[1].abs() + PUCK.radius_m > TABLE.half_width_m(),
        puck[0].abs() + PUCK.radius_m > TABLE.half_length_m(),
    ]
}

/// Whether the puck may touch a rim.
#[inline(always)]
pub fn near_rims(puck: [f64; 2]) -> bool {
    near(puck) != [false; 2]
}

/// Contacts of the puck with the rims; at most two at a time, in a corner.
pub fn rims(puck: [f64; 2], mut found: impl FnMut(Touch)) {
    let [near_long, near_short] = near(puck);
    if !near_long && !near_short {
        return;
    }
    let colliders = &*COLLIDERS;
    let pose = at(puck);
    if near_long {
        let rim = &colliders.long_rims[usize::from(puck[1] < 0.0)];
        touch((rim, *rim.position()), (&colliders.puck, pose)).map(&mut found);
    }
    if near_short {
        let rim =
            &colliders.short_rims[2 * usize::from(puck[0] < 0.0) + usize::from(puck[1] < 0.0)];
        touch((rim, *rim.position()), (&colliders.puck, pose)).map(&mut found);
    }
}

/// Contact of a mallet with the puck, normal into the puck.
pub fn mallet_and_puck(mallet: [f64; 2], puck: [f64; 2]) -> Option<Touch> {
    within(mallet, puck, TOOL.cylinder_radius_m + PUCK.radius_m)?;
    let colliders = &*COLLIDERS;
    touch((&colliders.mallet, at(mallet)), (&colliders.puck, at(puck)))
}

/// Contact of the two mallets, normal into the second.
pub fn mallets(first: [f64; 2], second: [f64; 2]) -> Option<Touch> {
    within(first, second, 2.0 * TOOL.cylinder_radius_m)?;
    let colliders = &*COLLIDERS;
    touch(
        (&colliders.mallet, at(first)),
        (&colliders.mallet, at(second)),
    )
}

/// The broad phase: nothing to find beyond this distance.
#[inline(always)]
fn within(a: [f64; 2], b: [f64; 2], distance: f64) -> Option<()> {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    (dx * dx + dy * dy < distance * distance).then_some(())
}
