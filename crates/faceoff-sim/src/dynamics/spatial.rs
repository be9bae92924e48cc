//! Spatial (six-dimensional) vectors and inertias, as in Featherstone's rigid-body dynamics: linear and angular parts in one, all taken
//! about the origin of the arm's base frame. `T` is one number per arm.
//!
//! With one common origin, velocities, forces and inertias of different links add without a transform. This
//! keeps the recursions short.

use super::lanes::Lanes;
use std::ops::{Add, Sub};

/// A vector in the arm's base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vec3<T> {
    /// Along the base's x.
    pub x: T,
    /// Along the base's y.
    pub y: T,
    /// Along the base's z, upwards.
    pub z: T,
}

impl<T: Lanes> Vec3<T> {
    #[inline(always)]
    pub fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }

    /// A vector of constants, the same for every arm.
    #[inline(always)]
    pub fn splat(v: [f64; 3]) -> Self {
        Self::new(T::splat(v[0]), T::splat(v[1]), T::splat(v[2]))
    }

    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat([0.0; 3])
    }

    #[inline(always)]
    pub fn dot(self, other: Self) -> T {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    #[inline(always)]
    pub fn scale(self, s: T) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }

    /// The vector of the arm in lane `i`.
    #[inline(always)]
    pub fn lane(self, i: usize) -> [f64; 3] {
        [self.x.lane(i), self.y.lane(i), self.z.lane(i)]
    }
}

impl Vec3<f64> {
    /// x, y and z.
    #[inline(always)]
    pub const fn to_array(self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }
}

impl<T: Lanes> Add for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<T: Lanes> Sub for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

/// A rotation and an origin: a link's frame in the arm's base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<T> {
    /// First column of the rotation.
    pub x: Vec3<T>,
    /// Second column of the rotation.
    pub y: Vec3<T>,
    /// Third column of the rotation.
    pub z: Vec3<T>,
    /// The frame's origin, m.
    pub origin: Vec3<T>,
}

impl<T: Lanes> Frame<T> {
    /// The base frame itself.
    #[inline(always)]
    pub fn base() -> Self {
        Self {
            x: Vec3::splat([1.0, 0.0, 0.0]),
            y: Vec3::splat([0.0, 1.0, 0.0]),
            z: Vec3::splat([0.0, 0.0, 1.0]),
            origin: Vec3::zero(),
        }
    }

    /// A direction of this frame, in the base frame.
    #[inline(always)]
    pub fn rotate(&self, v: [f64; 3]) -> Vec3<T> {
        self.x.scale(T::splat(v[0])) + self.y.scale(T::splat(v[1])) + self.z.scale(T::splat(v[2]))
    }

    /// A point of this frame, in the base frame.
    #[inline(always)]
    pub fn point(&self, v: [f64; 3]) -> Vec3<T> {
        self.origin + self.rotate(v)
    }

    /// The rotation as a row-major matrix, of one arm.
    pub fn rotation(&self, lane: usize) -> [f64; 9] {
        let (x, y, z) = (self.x.lane(lane), self.y.lane(lane), self.z.lane(lane));
        [x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]]
    }
}

/// A spatial velocity or acceleration: the angular part, and the linear part at the base's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<T> {
    /// rad/s or rad/s².
    pub angular: Vec3<T>,
    /// m/s or m/s².
    pub linear: Vec3<T>,
}

impl<T: Lanes> Motion<T> {
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            angular: Vec3::zero(),
            linear: Vec3::zero(),
        }
    }

    /// The motion of unit rate about a hinge through `point` along `axis`.
    #[inline(always)]
    pub fn hinge(axis: Vec3<T>, point: Vec3<T>) -> Self {
        Self {
            angular: axis,
            linear: point.cross(axis),
        }
    }

    /// The linear velocity, m/s, that this motion gives to a point (m).
    #[inline(always)]
    pub fn velocity_at(self, point: Vec3<T>) -> Vec3<T> {
        self.linear + self.angular.cross(point)
    }

    #[inline(always)]
    pub fn scale(self, s: T) -> Self {
        Self {
            angular: self.angular.scale(s),
            linear: self.linear.scale(s),
        }
    }

    /// The rate of change of a motion vector `other` that is carried along by this velocity.
    #[inline(always)]
    pub fn cross_motion(self, other: Self) -> Self {
        Self {
            angular: self.angular.cross(other.angular),
            linear: self.angular.cross(other.linear) + self.linear.cross(other.angular),
        }
    }

    /// The rate of change of a force vector (a momentum) that is carried along by this velocity.
    #[inline(always)]
    pub fn cross_force(self, f: Force<T>) -> Force<T> {
        Force {
            moment: self.angular.cross(f.moment) + self.linear.cross(f.force),
            force: self.angular.cross(f.force),
        }
    }

    /// The power of a force on this velocity; if `self` is a joint axis, the force's torque about it.
    #[inline(always)]
    pub fn dot(self, f: Force<T>) -> T {
        self.angular.dot(f.moment) + self.linear.dot(f.force)
    }
}

impl<T: Lanes> Add for Motion<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            angular: self.angular + other.angular,
            linear: self.linear + other.linear,
        }
    }
}

/// A spatial force or momentum: the moment about the base's origin, and the force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Force<T> {
    /// N m or N m s.
    pub moment: Vec3<T>,
    /// N or N s.
    pub force: Vec3<T>,
}

impl<T: Lanes> Force<T> {
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            moment: Vec3::zero(),
            force: Vec3::zero(),
        }
    }
}

impl<T: Lanes> Add for Force<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            moment: self.moment + other.moment,
            force: self.force + other.force,
        }
    }
}

/// A symmetric 3×3 matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Symmetric<T> {
    pub xx: T,
    pub yy: T,
    pub zz: T,
    pub xy: T,
    pub xz: T,
    pub yz: T,
}

impl<T: Lanes> Symmetric<T> {
    /// From the order xx, yy, zz, xy, xz, yz.
    #[inline(always)]
    pub fn splat(m: [f64; 6]) -> Self {
        let [xx, yy, zz, xy, xz, yz] = m.map(T::splat);
        Self {
            xx,
            yy,
            zz,
            xy,
            xz,
            yz,
        }
    }

    #[inline(always)]
    pub fn times(self, v: Vec3<T>) -> Vec3<T> {
        Vec3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// `R m Rᵀ`: the matrix m = `self`, given in the frame `f` with rotation R, in the base frame.
    #[inline(always)]
    fn rotated(self, f: &Frame<T>) -> Self {
        // The columns of R m.
        let a = f.x.scale(self.xx) + f.y.scale(self.xy) + f.z.scale(self.xz);
        let b = f.x.scale(self.xy) + f.y.scale(self.yy) + f.z.scale(self.yz);
        let c = f.x.scale(self.xz) + f.y.scale(self.yz) + f.z.scale(self.zz);
        Self {
            xx: a.x * f.x.x + b.x * f.y.x + c.x * f.z.x,
            yy: a.y * f.x.y + b.y * f.y.y + c.y * f.z.y,
            zz: a.z * f.x.z + b.z * f.y.z + c.z * f.z.z,
            xy: a.x * f.x.y + b.x * f.y.y + c.x * f.z.y,
            xz: a.x * f.x.z + b.x * f.y.z + c.x * f.z.z,
            yz: a.y * f.x.z + b.y * f.y.z + c.y * f.z.z,
        }
    }
}

impl<T: Lanes> Add for Symmetric<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            yy: self.yy + other.yy,
            zz: self.zz + other.zz,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yz: self.yz + other.yz,
        }
    }
}

/// A rigid body's spatial inertia about the base's origin, in the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia<T> {
    /// kg.
    pub mass: T,
    /// Mass times position of the centre of mass, kg m.
    pub first_moment: Vec3<T>,
    /// Rotational inertia about the base's origin, kg m².
    pub rotational: Symmetric<T>,
}

impl<T: Lanes> Inertia<T> {
    /// From mass (kg), centre of mass (m) and rotational inertia about it (kg m²; xx, yy, zz, xy, xz, yz), in the body's own `frame`.
    #[inline(always)]
    pub fn of_body(frame: &Frame<T>, mass: f64, centre: [f64; 3], rotational: [f64; 6]) -> Self {
        let about_centre = Symmetric::splat(rotational).rotated(frame);
        Self::with_centre(frame.point(centre), mass, about_centre)
    }

    /// From a rotational inertia about the centre of mass, kg m², that is the same about every axis.
    #[inline(always)]
    pub fn isotropic(centre: Vec3<T>, mass: f64, rotational: f64) -> Self {
        let zero = T::splat(0.0);
        let diagonal = T::splat(rotational);
        Self::with_centre(
            centre,
            mass,
            Symmetric {
                xx: diagonal,
                yy: diagonal,
                zz: diagonal,
                xy: zero,
                xz: zero,
                yz: zero,
            },
        )
    }

    /// From the centre of mass (m), and the rotational inertia about it, both in the base frame.
    #[inline(always)]
    fn with_centre(centre: Vec3<T>, mass: f64, about_centre: Symmetric<T>) -> Self {
        let mass = T::splat(mass);
        let (c, h) = (centre, centre.scale(mass));
        let (xx, yy, zz) = (h.x * c.x, h.y * c.y, h.z * c.z);
        // Steiner's theorem (parallel axes).
        let steiner = Symmetric {
            xx: yy + zz,
            yy: xx + zz,
            zz: xx + yy,
            xy: -(h.x * c.y),
            xz: -(h.x * c.z),
            yz: -(h.y * c.z),
        };
        Self {
            mass,
            first_moment: h,
            rotational: about_centre + steiner,
        }
    }

    /// The momentum of the body at a velocity, or the force for an acceleration.
    #[inline(always)]
    pub fn mul(&self, v: Motion<T>) -> Force<T> {
        Force {
            moment: self.rotational.times(v.angular) + self.first_moment.cross(v.linear),
            force: v.linear.scale(self.mass) - self.first_moment.cross(v.angular),
        }
    }

    /// A body of the same shape with `factor` times the mass.
    #[inline(always)]
    pub fn scaled(&self, factor: T) -> Self {
        let r = self.rotational;
        Self {
            mass: self.mass * factor,
            first_moment: self.first_moment.scale(factor),
            rotational: Symmetric {
                xx: r.xx * factor,
                yy: r.yy * factor,
                zz: r.zz * factor,
                xy: r.xy * factor,
                xz: r.xz * factor,
                yz: r.yz * factor,
            },
        }
    }
}

impl<T: Lanes> Add for Inertia<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            rotational: self.rotational + other.rotational,
        }
    }
}
