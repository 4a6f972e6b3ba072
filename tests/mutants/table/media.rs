//! Faults of the medium of a scene, on the trial scenes with one.

use super::{row, text};
use crate::{Check, Mutant, Plant, Subject};

const fn fault(name: &'static str, what: &'static str, plant: Plant) -> Mutant {
    row(name, what, plant, Subject::Media, Check::Media)
}

pub const MUTANTS: &[Mutant] = &[
    fault(
        "medium-absorbs-nothing",
        "what is absorbed is scattered",
        text(
            "integrator/medium",
            "select(there.x / there.y, 1.0, there.x >= there.y), true",
            "1.0, true",
        ),
    ),
    fault(
        "medium-without-a-limit",
        "what is scattered in a medium has no limit",
        text(
            "integrator/path",
            "@if(!queued) *result += limited(throughput * direct_light(point, depth, sampler), depth);",
            "@if(!queued) *result += throughput * direct_light(point, depth, sampler);",
        ),
    ),
    fault(
        "medium-albedo-twice",
        "the albedo counts twice",
        text(
            "integrator/path",
            "(*path).throughput *= flight.albedo;",
            "(*path).throughput *= flight.albedo * flight.albedo;",
        ),
    ),
    fault(
        "medium-collides-by-scattering",
        "a collision is accepted by σ_s, not σ",
        text(
            "integrator/medium",
            "next_number() * bounds.y < there.y",
            "next_number() * bounds.y < there.x",
        ),
    ),
    fault(
        "medium-majorant-too-small",
        "flights go by half the greatest extinction",
        text(
            "integrator/medium",
            "let majorant = bounds.y * unit;",
            "let majorant = 0.5 * bounds.y * unit;",
        ),
    ),
    fault(
        "medium-depth-begins-anew",
        "what a region took of the optical depth is forgotten",
        text(
            "integrator/medium",
            "left = max(left - (segment.exit - t) * majorant, 0.0);",
            "",
        ),
    ),
    fault(
        "medium-first-number-squared",
        "the first free flight is too short",
        text(
            "integrator/medium",
            "var left = -log(1.0 - first);",
            "var left = -log(1.0 - first * first);",
        ),
    ),
    fault(
        "medium-behind-surfaces",
        "light is scattered behind what a ray meets",
        text(
            "integrator/path",
            "@if(!sphere_lights) let end = hit.t;",
            "@if(!sphere_lights) let end = FAR;",
        ),
    ),
    fault(
        "medium-behind-balls-of-light",
        "light is scattered behind a ball of light",
        text(
            "integrator/path",
            "@if(sphere_lights) let end = first_sphere(Ray(ray.origin, ray.t_min, ray.direction, hit.t)).t;",
            "@if(sphere_lights) let end = hit.t;",
        ),
    ),
    fault(
        "medium-ball-is-a-box",
        "a medium in a ball fills its box",
        text(
            "integrator/medium",
            "placed.is_ball == 1u",
            "placed.is_ball == 2u",
        ),
    ),
    fault(
        "medium-unit-of-shadow-rays",
        "shadow rays count as of length 1",
        text(
            "integrator/medium",
            "let way = way_inside(along, ray.t_min, ray.t_max);\n    let unit = placed.density * length(ray.direction);",
            "let way = way_inside(along, ray.t_min, ray.t_max);\n    let unit = placed.density;",
        ),
    ),
    fault(
        "medium-before-lights-forgotten",
        "light samples are not dimmed by the medium",
        text(
            "integrator/path",
            "@if(media) light.radiance *= transmittance(light.shadow, index);",
            "",
        ),
    ),
    fault(
        "medium-control-forgotten",
        "what a region absorbs at least is left out for shadow rays",
        text(
            "integrator/medium",
            "result *= exp(-bounds.x * unit * (segment.exit - walk.t));",
            "",
        ),
    ),
    fault(
        "medium-shadow-majorant-too-small",
        "collisions of shadow rays are too rare",
        text(
            "integrator/medium",
            "let rest = (bounds.y - bounds.x) * unit;",
            "let rest = 0.5 * (bounds.y - bounds.x) * unit;",
        ),
    ),
    fault(
        "medium-shadow-by-scattering",
        "shadow rays lose σ_s alone",
        text(
            "integrator/medium",
            "saturate((bounds.y - there.y)",
            "saturate((bounds.y - there.x)",
        ),
    ),
    fault(
        "medium-phase-sign",
        "the phase function is evaluated backwards",
        text(
            "integrator/medium",
            "dot(surface.arriving, direction));",
            "-dot(surface.arriving, direction));",
        ),
    ),
    fault(
        "medium-phase-sampled-backwards",
        "directions are drawn around the way back",
        text(
            "integrator/medium",
            "surface.arriving, u);",
            "-surface.arriving, u);",
        ),
    ),
    fault(
        "medium-even-density",
        "directions in the medium have the density of even ones where light is found",
        text(
            "shading/bsdf",
            "vec3<f32>(1.0), scattered_pdf(surface, onward), false",
            "vec3<f32>(1.0), 0.07957747, false",
        ),
    ),
    fault(
        "medium-light-behind-nothing",
        "points in the medium choose lights of a tree as surfaces do",
        text(
            "shading/light/tree",
            "all(normal == vec3<f32>(0.0))",
            "false",
        ),
    ),
    fault(
        "medium-survival-by-flight",
        "paths survive by the number of their flight",
        text(
            "integrator/path",
            "@if(media) if (survival_number() >= survival)",
            "@if(media) if (sample_1d(sampler) >= survival)",
        ),
    ),
    fault(
        "medium-beyond-depth",
        "paths are scattered once more than allowed",
        text(
            "integrator/path",
            "depth == MAX_DEPTH || flight.albedo <= 0.0",
            "flight.albedo <= 0.0",
        ),
    ),
    fault(
        "medium-colours-null-without-weight",
        "collisions that are none leave the colours as they were",
        text(
            "integrator/coloured_medium",
            "passed *= lacking / none;",
            "",
        ),
    ),
    fault(
        "medium-colours-even-shares",
        "channels decide in even shares, whatever the throughput",
        text(
            "integrator/coloured_medium",
            "throughput / (throughput.x + throughput.y + throughput.z)",
            "vec3<f32>(0.33333334)",
        ),
    ),
    fault(
        "medium-colours-tints-exchanged",
        "scattering has the tint of absorption, and the opposite",
        text(
            "integrator/coloured_medium",
            "placed.scattering_tint * there.x + placed.absorption_tint",
            "placed.absorption_tint * there.x + placed.scattering_tint",
        ),
    ),
    fault(
        "medium-colours-majorant-too-small",
        "flights go by the least extinction of a region",
        text(
            "integrator/coloured_medium",
            "let most = greatest(range.least + range.more);",
            "let most = greatest(range.least);",
        ),
    ),
    fault(
        "medium-colours-scatter-white",
        "what is scattered has no colour",
        text(
            "integrator/coloured_medium",
            "passed * placed.scattering_tint * (there.x / mean)",
            "passed * (there.x / mean)",
        ),
    ),
    fault(
        "medium-colours-pass-white",
        "light that passes keeps its colour",
        text(
            "integrator/coloured_medium",
            "    return Flight(end, passed, false);",
            "    return Flight(end, vec3<f32>(1.0), false);",
        ),
    ),
    fault(
        "medium-colours-control-of-one",
        "shadow rays lose the greatest of what channels lose at least",
        text(
            "integrator/coloured_medium",
            "result *= exp(-range.least * unit",
            "result *= exp(-greatest(range.least) * unit",
        ),
    ),
    fault(
        "medium-colours-control-twice",
        "what channels lose at least is lost again at collisions",
        text(
            "integrator/coloured_medium",
            "(extinction(there) - range.least)",
            "extinction(there)",
        ),
    ),
    fault(
        "several-media-last-wins",
        "of several media the last that scatters does, not the nearest",
        text(
            "integrator/several_media",
            "flight_through(ray, nearest.t, first_number(index, first));",
            "flight_through(ray, end, first_number(index, first));",
        ),
    ),
    fault(
        "several-media-pass-the-first-alone",
        "shadow rays lose what the first medium takes",
        text(
            "integrator/several_media",
            "var result = 1.0;\n    for (var index = 0u; index < media.count; index++)",
            "var result = 1.0;\n    for (var index = 0u; index < 1u; index++)",
        ),
    ),
    fault(
        "several-media-phase-of-the-first",
        "all media scatter by the phase function of the first",
        text(
            "integrator/several_media",
            "scatterer = index;\n        }\n    }\n    follow_medium(scatterer);",
            "scatterer = index;\n        }\n    }\n    follow_medium(0u);",
        ),
    ),
    fault(
        "several-media-grid-of-the-first",
        "all media read the grid of the first",
        text(
            "integrator/several_media",
            "let place = shading_row(row + 2u);",
            "let place = shading_row(media.first + 2u);",
        ),
    ),
    fault(
        "several-media-place-of-the-first",
        "all media are where the first one is, and as dense",
        text(
            "integrator/several_media",
            "shading_row(row + 3u)",
            "shading_row(media.first + 3u)",
        ),
    ),
    fault(
        "several-media-share-numbers",
        "all media draw the same numbers",
        text(
            "integrator/several_media",
            "numbered = index << PURPOSE_BITS;",
            "numbered = 0u;",
        ),
    ),
    fault(
        "several-media-share-the-first-number",
        "the sampler's number is that of the first collision in each medium",
        text(
            "integrator/several_media",
            "if (index == 0u) { return of_sampler; }",
            "return of_sampler;",
        ),
    ),
    fault(
        "several-media-share-numbers-to-lights",
        "shadow rays draw the same numbers in all media",
        text(
            "integrator/medium",
            "begin_purpose(TO_LIGHT + light + numbered);",
            "begin_purpose(TO_LIGHT + light);",
        ),
    ),
    fault(
        "several-media-colours-of-the-last",
        "collisions that are none in a medium leave the colours as they were where the next one scatters",
        text(
            "integrator/several_media",
            "index < scatterer; index++",
            "index < 0u; index++",
        ),
    ),
    fault(
        "several-media-colours-to-the-end",
        "collisions that are none behind the nearest one change colours, too",
        text(
            "integrator/several_media",
            "nearest.albedo *= flight_through(ray, nearest.t,",
            "nearest.albedo *= flight_through(ray, end,",
        ),
    ),
    fault(
        "several-media-tints-of-the-first",
        "what all media scatter has the colours of the first",
        text(
            "integrator/several_media",
            "shading_row(row + 6u)",
            "shading_row(media.first + 6u)",
        ),
    ),
];
