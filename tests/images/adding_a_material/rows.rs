//! Two kinds of materials: their rendering and check rows.

use glam::{DVec3, Vec3, vec3};
use raystone::measure::kinds::KindChecks;
use raystone::measure::materials::MaterialChecks;
use raystone::measure::mitsuba::by_formula;
use raystone::measure::path_oracle::{
    Bounce, Bsdf, Reflected, Rounding, Surface, bounce, cosine_density, cosine_direction, kept,
    mirrored, parameter,
};
use raystone::scene::{Description, Format, Lobes, Look, Material, MaterialKind};

/// A surface that is darker towards grazing angles.
pub static MINNAERT: MaterialKind = MaterialKind {
    name: "minnaert",
    feature: "minnaert",
    description: "diffuse reflection that darkens towards grazing angles (MTL illum 10 with Ns)",
    parameters: &["exponent"],
    lobes: Lobes::Glossy,
    sources: &[(
        "shading/bsdf/minnaert",
        include_str!("kernels/shading/bsdf/minnaert.wesl"),
    )],
    recognise,
};

fn recognise(description: &Description<'_>) -> Option<Look> {
    let is_ours = description.format == Format::Mtl && description.source.illum == Some(10);
    let exponent = description.source.shininess.filter(|_| is_ours)?;
    Some(look(description.base_color, exponent))
}

fn look(base: Vec3, parameter: f32) -> Look {
    Look {
        parameters: vec![parameter],
        ..Look::plain(base)
    }
}

pub fn minnaert(exponent: f32) -> Material {
    let look = look(vec3(0.9, 0.6, 0.4), exponent);
    Material::looking("minnaert", &MINNAERT, look)
}

pub static MINNAERT_CHECKS: MaterialChecks = MaterialChecks {
    python: "class Minnaert(Opaque):
    distribution = mi.MicrofacetType.Beckmann

    def alpha(self):
        return 1.0

    def reflected(self, base, wi, wo):
        return base * dr.inv_pi * wo.z * (wi.z * wo.z) ** self.numbers[0]


mi.register_bsdf(\"raystone-minnaert\", Minnaert)
",
    balls: || vec![(None, minnaert(0.5)), (None, minnaert(2.0))],
    planes: || vec![("minnaert", minnaert(0.7))],
    ..MaterialChecks::new(&MINNAERT, |surface| Box::new(Minnaert(surface)), by_formula)
};

struct Minnaert<'a>(&'a Surface<'a>);

impl Bsdf for Minnaert<'_> {
    fn sample(&self, uv: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        bounce(self, cosine_direction(self.0.normal, uv), rounding)
    }

    fn folded(&self) -> Option<&Surface<'_>> {
        Some(self.0)
    }

    fn evaluate(&self, direction: DVec3, _: &mut Rounding) -> Option<Reflected> {
        let surface = self.0;
        let density = cosine_density(surface.normal, direction);
        let product = surface.normal.dot(direction) * surface.normal.dot(surface.out);
        (density > 0.0).then(|| Reflected {
            value: surface.base * density * product.max(0.0).powf(parameter(surface, 0)),
            density,
        })
    }
}

/// A partially transmitting surface.
pub static GAUZE: MaterialKind = MaterialKind {
    name: "gauze",
    feature: "gauze",
    description: "a thin mirror that a part of the light passes",
    parameters: &["part that passes"],
    lobes: Lobes::Delta,
    sources: &[(
        "shading/bsdf/gauze",
        include_str!("kernels/shading/bsdf/gauze.wesl"),
    )],
    recognise: |_| None,
};

pub fn gauze() -> Material {
    Material::looking("gauze", &GAUZE, look(vec3(0.9, 0.95, 0.8), 0.6))
}

pub static GAUZE_CHECKS: MaterialChecks = MaterialChecks {
    balls: || vec![(None, gauze())],
    ..MaterialChecks::new(
        &GAUZE,
        |surface| Box::new(Gauze(surface)),
        |material, color, id, warnings| {
            let name = &material.name;
            warnings.push(format!("material {name}: Mitsuba draws its mirror alone"));
            let color = color.named("specular_reflectance");
            format!("    <bsdf type=\"conductor\" {id}>{color}</bsdf>\n")
        },
    )
};

struct Gauze<'a>(&'a Surface<'a>);

impl Bsdf for Gauze<'_> {
    fn sample(&self, [u, _]: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        let surface = self.0;
        let direction = if u < rounding.share(parameter(surface, 0)) {
            -surface.out
        } else {
            rounding.direction(kept(surface, mirrored(surface.out, surface.normal)))
        };
        Some(Bounce {
            direction,
            weight: surface.base,
            density: None,
            medium: 1.0,
        })
    }

    fn evaluate(&self, _: DVec3, _: &mut Rounding) -> Option<Reflected> {
        None
    }

    fn is_delta(&self) -> bool {
        true
    }
}

/// The program's kinds and these two.
pub fn kinds() -> KindChecks {
    let mut kinds = KindChecks::default();
    kinds.materials.register(&MINNAERT_CHECKS);
    kinds.materials.register(&GAUZE_CHECKS);
    kinds
}
