//! The C function `hypotf` (√(x² + y²)), as part of this program, so that it also starts on systems with glibc 2.34, such as RHEL 9.
//!
//! resvg calls it for groups with filters. glibc has had two versions of it since 2.35, and a program linked with a newer glibc asks for
//! the second. The linker prefers this one.

#[expect(unsafe_code, reason = "the linker finds it by its C name")]
#[unsafe(no_mangle)]
extern "C" fn hypotf(x: f32, y: f32) -> f32 {
    libm::hypotf(x, y)
}
