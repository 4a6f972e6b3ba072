//! Faults planted in the kernels of materials, which must be detected.

use super::reference::Model;
use super::{Seen, faults_of};
use crate::support::kernels_with;

type Concerns = fn(&Model) -> bool;

fn seen(file: &str, concerns: Concerns, changes: &[(&str, &str)]) {
    assert!(changes.len() >= 5, "too few faults");
    for (from, to) in changes {
        let found = faults_of(kernels_with(file, &[(from, to)]), Seen::First, concerns);
        assert!(!found.is_empty(), "`{to}` for `{from}` is not seen");
    }
}

#[test]
fn faults_of_lobes_are_seen() {
    seen(
        "shading/bsdf/lobes",
        |m| matches!(m, Model::Phong { .. }),
        &[
            ("first * base + pdf * second", "first * base + second"),
            ("p * first + (1.0 - p) * pdf", "p * first + pdf"),
            ("min(u / p, BELOW_ONE)", "u"),
            ("(u - p) / (1.0 - p)", "u"),
            ("(first * base + pdf * second) / density", "base"),
            ("cosine * INVERSE_PI", "cosine * 0.5 * INVERSE_PI"),
            ("sine * sin(angle)", "sine * cos(angle)"),
        ],
    );
}

#[test]
fn faults_of_phong_are_seen() {
    seen(
        "shading/bsdf/phong",
        |m| matches!(m, Model::Phong { .. }),
        &[
            (
                "0.5 * INVERSE_PI * (lobe.w + 1.0)",
                "0.5 * INVERSE_PI * (lobe.w + 2.0)",
            ),
            ("1.0 / (lobe.w + 1.0)", "1.0 / (lobe.w + 2.0)"),
            ("1.0 - cosine * cosine", "1.0 - cosine"),
            (
                "exp(exponent * logarithm)",
                "exp((exponent + 1.0) * logarithm)",
            ),
            ("if (x >= 1.0)", "if (x >= 0.5)"),
            ("x * (0.5 + x", "x * (0.25 + x"),
            ("basis_around(mirrored(surface))", "surface.shading"),
            ("if (cosine <= 0.0)", "if (cosine < -2.0)"),
            (
                "base, cosine, lobe.xyz, pdf)",
                "base, cosine, lobe.zyx, pdf)",
            ),
        ],
    );
}

#[test]
fn faults_of_cook_torrance_are_seen() {
    seen(
        "shading/bsdf/cook_torrance",
        |m| matches!(m, Model::CookTorrance(_)),
        &[
            ("* h.z / (4.0 * cosine)", "/ (4.0 * cosine)"),
            ("-lobe.w * lobe.w * log", "-lobe.w * log"),
            (
                "squared_roughness * squared_cosine * squared_cosine)",
                "squared_roughness * squared_cosine)",
            ),
            ("min(o.z, i.z)", "o.z"),
            ("3.535 * a", "3.835 * a"),
            (
                "smith_seen(o, roughness) * smith_seen(i, roughness)",
                "smith_seen(i, roughness)",
            ),
            ("if (more.z > 0.0)", "if (more.z > 2.0)"),
            ("more.y > 0.0", "more.y > 2.0"),
            (
                "reflectance * seen * cosine / (o.z * h.z)",
                "reflectance * seen * cosine / (i.z * h.z)",
            ),
            ("if (i.z <= 0.0)", "if (i.z < -2.0)"),
        ],
    );
}

#[test]
fn faults_of_principled_are_seen() {
    seen(
        "shading/bsdf/principled",
        |m| matches!(m, Model::Principled { .. }),
        &[
            ("max(roughness * roughness, 0.001)", "max(roughness, 0.001)"),
            ("0.5 * look.y + 2.0 * look.y", "0.5 + 2.0 * look.y"),
            ("1.0 / 1.51", "1.0 / 1.6"),
            (
                "schlick_from(look.z, i.z));",
                "schlick_from(look.z, cosine));",
            ),
            ("(1.0 + before) / (1.0 + both)", "1.0 / (1.0 + both)"),
            ("((1.0 + before) * 4.0 * o.z)", "(4.0 * o.z)"),
            ("(1.0 - u.y) * (1.0 + w.z) - w.z", "1.0 - u.y"),
            ("vec3<f32>(alpha * cap.xy, cap.z)", "cap"),
            ("clamp(diffuse / (specular + diffuse), 0.1, 0.9)", "0.5"),
            ("look.x * metal_schlick(base, cosine)", "look.x * base"),
            ("if (i.z <= 0.0)", "if (i.z < -2.0)"),
            ("squared * h.z * h.z + dot", "squared * h.z + dot"),
        ],
    );
}

#[test]
fn faults_of_schlicks_polynomial_are_seen() {
    seen(
        "shading/bsdf/fresnel",
        |m| matches!(m, Model::CookTorrance(_)),
        &[
            ("squared * squared * rest", "squared * squared"),
            ("r0 + (1.0 - r0) * fifth", "r0 + fifth"),
            ("let r0 = straight * straight", "let r0 = straight"),
            ("(eta - 1.0) / (eta + 1.0)", "(eta - 1.0) / eta"),
            (
                "select(cos_refracted, cos_arriving, eta >= 1.0)",
                "cos_refracted",
            ),
            (
                "(eta * cos_arriving - cos_refracted)",
                "(cos_arriving - cos_refracted)",
            ),
        ],
    );
}
