//! What the view tells the page, as JSON.

use raystone_bench::run::Registries;
use raystone_config::Axis;
use raystone_core::params::{Choice as _, Entry, ParamRange, ParamValue, Parameter, Variant};
use raystone_gpu::Gpu;
use raystone_viewer::{Frame, Inspection, START, SamplePoints, Screen, Seen, SideFrame};
use serde_json::{Map, Value, json};

/// Axes on which the page offers a choice.
pub(crate) const AXES: [Axis; 6] = [
    Axis::Scene,
    Axis::Accel,
    Axis::Sequence,
    Axis::Decorrelation,
    Axis::Integrator,
    Axis::Organisation,
];

/// The adapter, and what can be chosen.
pub(crate) fn opened(gpu: &Gpu, registries: &Registries) -> Value {
    let catalogue = registries.catalogue();
    let is_rendered = |name: &str| registries.integrators.get(name).is_some();
    let start = Screen::parse(START, "view", &[], registries).ok();
    let first = |axis: Axis| {
        let cell = start.as_ref().and_then(|screen| screen.cells[0].get(axis));
        cell.map(|chosen| chosen.name.clone())
            .or(axis.default_name().map(str::to_owned))
    };
    let entries = |axis: Axis| -> Value {
        let entries = catalogue[axis].iter();
        let shown = entries.filter(|entry| axis != Axis::Integrator || is_rendered(&entry.name));
        json!({ "first": first(axis), "entries": shown.map(choice).collect::<Vec<_>>() })
    };
    let axes = AXES.map(|axis| (axis.name().to_owned(), entries(axis)));
    // Any model has what every scene has.
    let model = catalogue.entry(Axis::Scene, "model.obj");
    json!({
        "adapter": gpu.info.name,
        "software": gpu.is_software(),
        "axes": Map::from_iter(axes),
        "model": model.as_ref().map(choice),
    })
}

fn choice(entry: &Entry) -> Value {
    let parameters: Vec<Value> = entry.schema.iter().filter_map(parameter).collect();
    json!({
        "name": entry.name,
        "description": entry.description,
        "parameters": parameters,
    })
}

/// What the page needs to ask for a parameter; `None` if that takes more than a number, a switch, a text or a list of names.
pub(crate) fn parameter(known: &Parameter) -> Option<Value> {
    let range = match &known.range {
        ParamRange::Number { min, max } => json!({ "min": min, "max": max, "step": "any" }),
        ParamRange::Integer { min, max } => json!({ "min": min, "max": max, "step": 1 }),
        ParamRange::Choice(names) => json!({ "names": names }),
        ParamRange::Flag => json!({}),
        ParamRange::Text => json!({ "text": "any" }),
        ParamRange::Filled => json!({ "text": "filled" }),
        _ => return None,
    };
    Some(json!({
        "name": known.name,
        "description": known.description,
        "default": plain(known.default_written()?)?,
        "range": range,
    }))
}

fn plain(value: &ParamValue) -> Option<Value> {
    Some(match value {
        ParamValue::Number(x) => json!(x),
        ParamValue::Integer(n) => json!(n),
        ParamValue::Flag(is_on) => json!(is_on),
        ParamValue::Name(name) => json!(name),
        ParamValue::List(_) => return None,
    })
}

/// What is on screen, for the controls of the page.
pub(crate) fn shown(screen: &Screen) -> Value {
    let variant = |variant: &Variant| {
        let params = variant.params.0.iter();
        let params = params.filter_map(|(name, value)| Some((name.clone(), plain(value)?)));
        json!({ "name": variant.name, "params": Map::from_iter(params) })
    };
    let cells = screen.cells.iter().map(|cell| {
        let chosen = AXES
            .into_iter()
            .filter_map(|axis| Some((axis, cell.get(axis)?)));
        Map::from_iter(chosen.map(|(axis, chosen)| (axis.name().to_owned(), variant(chosen))))
    });
    let window = &screen.window;
    json!({
        "sides": cells.collect::<Vec<_>>(),
        "size": screen.size,
        "spp": screen.spp,
        "map": window.map.name(),
        "exposure": window.exposure,
        "swipe": window.swipe,
        "error": window.error,
        "motion": screen.animation.map(|animation| json!({
            "of": animation.motion.name(),
            "frames": animation.frames,
            "amplitude": animation.amplitude,
            "wavelength": animation.wavelength,
        })),
        "play": window.play,
        "frame": window.frame,
        "frame_spp": window.frame_spp,
        "follow": window.follow.name(),
    })
}

/// The figures of what is drawn.
pub(crate) fn figures(frame: &Frame) -> Value {
    let side = |side: &SideFrame| {
        let known = &side.figures;
        json!({
            "label": side.label,
            "fault": side.fault,
            "spp": known.spp,
            "of": known.of,
            "sample_ms": known.sample_ms.last(),
            "mrays_s": known.mrays_s,
            "rays": known.rays.iter().map(|r| (r.class, r.per_sample, r.mrays_s)).collect::<Vec<_>>(),
            "relmse": known.relmse,
            "flip": known.flip,
            "map_mean": known.map_mean,
            "nodes": known.structure.nodes,
            "bytes": known.structure.bytes,
            "sah_cost": known.structure.sah_cost,
        })
    };
    let times = frame.times.as_ref().map(|times| {
        json!({
            "whole_ms": times.whole_ms.last(),
            "scene_ms": times.scene_ms,
            "sides": times.sides.iter().map(|side| [side.update_ms, side.render_ms]).collect::<Vec<_>>(),
            "rest_ms": times.rest_ms(),
        })
    });
    json!({
        "triangles": frame.triangles,
        "objects": frame.objects,
        "scale": frame.scale,
        "reference_spp": frame.reference_spp,
        "times": times,
        "sides": frame.sides.iter().map(side).collect::<Vec<_>>(),
    })
}

/// What the images have at a pixel.
pub(crate) fn inspected(inspection: &Inspection) -> Value {
    json!({
        "pixel": inspection.pixel,
        "ray": inspection.ray.to_string(),
        "sides": inspection.sides.iter().map(Seen::rows).collect::<Vec<_>>(),
    })
}

/// The points of a pixel.
pub(crate) fn points(points: &SamplePoints) -> Value {
    json!({
        "purpose": points.purpose,
        "points": points.points,
        "star": points.star,
    })
}
