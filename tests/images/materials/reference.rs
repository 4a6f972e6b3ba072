//! Reflection in f64, from the formulas of `docs/shading.md` in angles, unlike the kernels.

use glam::{DVec3, Vec3};
use raystone::scene::{CookTorrance, Fresnel, Masking, Material};
use std::f64::consts::PI;

/// A material's constructor arguments.
#[derive(Debug, Clone, Copy)]
pub enum Model {
    Diffuse {
        base: Vec3,
    },
    Phong {
        base: Vec3,
        specular: Vec3,
        exponent: f32,
    },
    CookTorrance(CookTorrance),
    Principled {
        base: Vec3,
        metallic: f32,
        roughness: f32,
        f0: f32,
    },
}

fn luminance(c: DVec3) -> f64 {
    c.dot(DVec3::new(0.212671, 0.715160, 0.072169))
}

/// Reflectance by sines and tangents of both angles (Fresnel 1823), or Schlick's polynomial.
fn fresnel(kind: Fresnel, cosine: f64, eta: f64) -> f64 {
    let straight = ((eta - 1.0) / (eta + 1.0)).powi(2);
    if kind == Fresnel::Schlick {
        return straight + (1.0 - straight) * (1.0 - cosine).powi(5);
    }
    let angle = cosine.clamp(0.0, 1.0).acos();
    let refracted = (angle.sin() / eta).asin();
    let (difference, sum) = (angle - refracted, angle + refracted);
    if sum < 1e-4 {
        return straight;
    }
    let perpendicular = (difference.sin() / sum.sin()).powi(2);
    let parallel = (difference.tan() / sum.tan()).powi(2);
    0.5 * (perpendicular + parallel)
}

/// Visible fraction of Beckmann facets, by Walter's approximation.
fn smith(cosine: f64, roughness: f64) -> f64 {
    let a = 1.0 / (roughness * cosine.min(1.0).acos().tan());
    if a < 1.6 {
        (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a)
    } else {
        1.0
    }
}

fn hidden(cosine: f64, alpha: f64) -> f64 {
    ((1.0 + (alpha * cosine.min(1.0).acos().tan()).powi(2)).sqrt() - 1.0) / 2.0
}

/// Two lobes: probability of the diffuse one, f · cos of both, density of the second.
struct Lobes {
    share: f64,
    value: DVec3,
    second: f64,
}

impl Model {
    pub fn material(&self) -> Material {
        match *self {
            Self::Diffuse { base } => Material::diffuse("m", base),
            Self::Phong {
                base,
                specular,
                exponent,
            } => Material::phong("m", base, specular, exponent),
            Self::CookTorrance(ref of) => Material::cook_torrance("m", of),
            Self::Principled {
                base,
                metallic,
                roughness,
                f0,
            } => Material::principled("m", base, metallic, roughness, f0),
        }
    }

    /// Local directions, z along the normal, both above the surface.
    fn lobes(&self, o: DVec3, i: DVec3) -> Lobes {
        let h = (o + i).normalize();
        let share = |a: DVec3, b: DVec3| match luminance(a) + luminance(b) {
            0.0 => 1.0,
            both => luminance(a) / both,
        };
        match *self {
            Self::Diffuse { base } => Lobes {
                share: 1.0,
                value: base.as_dvec3() * i.z / PI,
                second: 0.0,
            },
            Self::Phong {
                base,
                specular,
                exponent,
            } => {
                let (base, specular) = (base.as_dvec3(), specular.as_dvec3());
                let mirror = DVec3::new(-o.x, -o.y, o.z);
                let e = f64::from(exponent);
                let lobe = (e + 1.0) / (2.0 * PI) * i.dot(mirror).max(0.0).powf(e);
                let above = if i.dot(mirror) > 0.0 { lobe } else { 0.0 };
                Lobes {
                    share: share(base, specular),
                    value: base * i.z / PI + specular * above,
                    second: above,
                }
            }
            Self::CookTorrance(of) => {
                let (base, specular) = (of.diffuse.as_dvec3(), of.specular.as_dvec3());
                let m = f64::from(of.roughness);
                let angle = h.z.min(1.0).acos();
                let d = (-(angle.tan() / m).powi(2)).exp() / (PI * m * m * angle.cos().powi(4));
                let seen = match of.masking {
                    Masking::Smith => smith(o.z, m) * smith(i.z, m),
                    Masking::VCavities => {
                        let edge = |c: f64| 2.0 * h.z * c / o.dot(h);
                        edge(o.z).min(edge(i.z)).min(1.0)
                    }
                };
                let f = fresnel(of.fresnel, o.dot(h), f64::from(of.ior));
                Lobes {
                    share: share(base, specular),
                    value: base * i.z / PI + specular * (f * seen * d / (4.0 * o.z)),
                    second: d * h.z / (4.0 * o.dot(h)),
                }
            }
            Self::Principled { .. } => self.principled(o, i, h),
        }
    }

    fn principled(&self, o: DVec3, i: DVec3, h: DVec3) -> Lobes {
        let Self::Principled {
            base,
            metallic,
            roughness,
            f0,
        } = *self
        else {
            unreachable!("it is called for this kind alone");
        };
        let base = base.as_dvec3();
        let [metallic, roughness, f0] = [metallic, roughness, f0].map(f64::from);
        let schlick = |f0: DVec3, x: f64| f0 + (DVec3::ONE - f0) * (1.0 - x).powi(5);
        let coat = |x: f64| schlick(DVec3::splat(f0), x).x;
        let cosine = o.dot(h);
        let d90 = roughness / 2.0 + 2.0 * roughness * cosine * cosine;
        let grazing = |x: f64| 1.0 + (d90 - 1.0) * (1.0 - x).powi(5);
        let energy = 1.0 - roughness + roughness / 1.51;
        let diffuse = base / PI * energy * grazing(i.z) * grazing(o.z);
        let alpha = (roughness * roughness).max(0.001);
        let angle = h.z.min(1.0).acos();
        // GGX in the tangent.
        let spread = 1.0 + (angle.tan() / alpha).powi(2);
        let d = 1.0 / (PI * alpha * alpha * angle.cos().powi(4) * spread * spread);
        let (before, after) = (hidden(o.z, alpha), hidden(i.z, alpha));
        let specular = d / (1.0 + before + after) / (4.0 * o.z * i.z);
        let mixed = (1.0 - coat(o.z)) * (1.0 - coat(i.z)) * diffuse + coat(cosine) * specular;
        let f = (1.0 - metallic) * mixed + metallic * schlick(base, cosine) * specular;
        let found = (1.0 - metallic) * coat(o.z) + metallic * luminance(schlick(base, o.z));
        let through = (1.0 - metallic) * (1.0 - coat(o.z)) * luminance(base);
        let share = if metallic < 1.0 && luminance(base) > 0.0 {
            (through / (found + through)).clamp(0.1, 0.9)
        } else {
            0.0
        };
        Lobes {
            share,
            value: f * i.z,
            second: d / ((1.0 + before) * 4.0 * o.z),
        }
    }

    pub fn value(&self, o: DVec3, i: DVec3) -> DVec3 {
        if i.z > 0.0 {
            self.lobes(o, i).value
        } else {
            DVec3::ZERO
        }
    }

    pub fn pdf(&self, o: DVec3, i: DVec3) -> f64 {
        if i.z <= 0.0 {
            return 0.0;
        }
        let lobes = self.lobes(o, i);
        lobes.share * i.z / PI + (1.0 - lobes.share) * lobes.second
    }
}

/// Narrow to wide lobes of every kind, both lobes and either alone.
pub fn models() -> Vec<Model> {
    let (base, specular) = (Vec3::new(0.5, 0.3, 0.1), Vec3::new(0.2, 0.4, 0.6));
    let mut out = vec![Model::Diffuse { base }];
    for exponent in [0.0, 1.0, 30.0, 2000.0] {
        out.push(Model::Phong {
            base,
            specular,
            exponent,
        });
    }
    out.push(Model::Phong {
        base: Vec3::ZERO,
        specular,
        exponent: 5.0,
    });
    for (roughness, masking, fresnel) in [
        (0.05, Masking::VCavities, Fresnel::Exact),
        (0.2, Masking::Smith, Fresnel::Exact),
        (0.5, Masking::VCavities, Fresnel::Schlick),
        (1.0, Masking::Smith, Fresnel::Schlick),
    ] {
        let (diffuse, specular, ior) = (base, specular, 1.5);
        let of = CookTorrance {
            diffuse,
            specular,
            roughness,
            ior,
            masking,
            fresnel,
        };
        out.push(Model::CookTorrance(of));
    }
    let base = Vec3::new(0.9, 0.6, 0.2);
    for (metallic, roughness, f0) in [
        (0.0, 0.1, 0.04),
        (0.0, 0.5, 0.04),
        (0.0, 1.0, 0.16),
        (0.5, 0.3, 0.04),
        (1.0, 0.0, 0.04),
        (1.0, 0.25, 0.04),
        (1.0, 0.8, 0.04),
    ] {
        out.push(Model::Principled {
            base,
            metallic,
            roughness,
            f0,
        });
    }
    out
}
