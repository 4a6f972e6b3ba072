//! Materials and textures.

use super::*;

fn textured(name: &'static str) -> Case {
    let uvs = CORNERS.iter().flat_map(|[x, y, _]| [*x, *y]);
    case(name)
        .accessor(floats(uvs), 5126, "VEC2", 4)
        .set("/meshes/0/primitives/0/attributes/TEXCOORD_0", json!(2))
        .material(
            json!({"name": "wood", "pbrMetallicRoughness": {"metallicFactor": 0,
            "baseColorFactor": [0.2, 0.4, 0.6, 1], "baseColorTexture": {"index": 0}}}),
        )
        .set("/textures", json!([{"source": 0}]))
        .set("/images", json!([{"uri": "wood.png"}]))
        .file("wood.png", image(image::ImageFormat::Png))
}

fn image(format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let pixels = image::RgbImage::from_raw(2, 1, vec![255, 0, 0, 0, 0, 255]).expect("a size");
    pixels.write_to(&mut bytes, format).expect("an image");
    bytes.into_inner()
}

impl Loaded {
    #[track_caller]
    fn images(self, count: usize) -> Self {
        assert_eq!(self.scene().textures.len(), count, "{}", self.name);
        self
    }
}

/// The constant of [`textured`].
const PLAIN: [f32; 3] = [0.2, 0.4, 0.6];

#[test]
fn textures_are_drawn_or_their_constant_is() {
    textured("a texture").load().whole(2).images(1);
    let with_tangents = |name| {
        textured(name)
            .accessor(floats([1.0, 0.0, 0.0, 1.0].repeat(4)), 5126, "VEC4", 4)
            .set("/meshes/0/primitives/0/attributes/TANGENT", json!(3))
    };
    with_tangents("tangents that nothing uses").load().whole(2);
    with_tangents("tangents of a bent normal")
        .set("/materials/0/normalTexture", json!({"index": 0}))
        .load()
        .but(2, &["`TANGENT` (mesh 0 `square`, primitive 0)"]);
    textured("a source of its own")
        .set(
            "/textures/0/extensions",
            json!({"KHR_texture_basisu": {"source": 9}}),
        )
        .set("/extensionsUsed", json!(["KHR_texture_basisu"]))
        .load()
        .but(2, &["the extension `KHR_texture_basisu` (texture 0)"])
        .images(1);
    textured("a source of an extension alone")
        .set(
            "/textures",
            json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}]),
        )
        .set("/extensionsRequired", json!(["KHR_texture_basisu"]))
        .load()
        .but(
            2,
            &[
                "its only image is that of `KHR_texture_basisu`",
                "drawn with the constant",
            ],
        )
        .images(0)
        .color(PLAIN);
    let smooth = textured("a smooth metal")
        .set("/materials/0/pbrMetallicRoughness/metallicFactor", json!(1))
        .set(
            "/materials/0/pbrMetallicRoughness/roughnessFactor",
            json!(0),
        )
        .load()
        .whole(2)
        .images(1);
    let [mirror, ..] = &smooth.scene().materials[..] else {
        panic!("no material");
    };
    assert_eq!(mirror.kind, &crate::MIRROR);
    assert!(mirror.base_color_texture.is_some(), "{mirror:?}");
    let bent = textured("bent glass")
        .set(
            "/materials/0",
            json!({"pbrMetallicRoughness": {"metallicFactor": 0}, "normalTexture": {"index": 0},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}),
        )
        .set(
            "/materials/0/pbrMetallicRoughness/roughnessFactor",
            json!(0),
        )
        .load()
        .whole(2)
        .images(1);
    let glass = &bent.scene().materials[0];
    assert_eq!(glass.kind, &crate::DIELECTRIC);
    assert!(glass.normal_texture.is_some(), "{glass:?}");
    textured("a file whose name alone tells its format")
        .set("/images/0", json!({"uri": "wood.tga", "name": "wood"}))
        .file("wood.tga", image(image::ImageFormat::Tga))
        .load()
        .whole(2)
        .images(1);
    for code in [33_069, 10_496] {
        textured("an unknown way to wrap")
            .set("/textures/0/sampler", json!(0))
            .set("/samplers", json!([{"wrapS": 33_071, "wrapT": code}]))
            .load()
            .but(2, &["wrap in an unknown way", "sampler 0"])
            .images(1);
    }
    textured("known ways to wrap")
        .set("/textures/0/sampler", json!(0))
        .set("/samplers", json!([{"wrapS": 33_648, "wrapT": 10_497}]))
        .load()
        .whole(2);
    let unused = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 7}}});
    textured("a texture that is not there of a material that no face has")
        .set("/materials/-", unused)
        .load()
        .whole(2)
        .images(1);
    textured("an image for browsers alone")
        .set(
            "/textures",
            json!([{"extensions": {"EXT_texture_webp": {"source": 0}}}]),
        )
        .set("/extensionsRequired", json!(["EXT_texture_webp"]))
        .file("wood.png", image(image::ImageFormat::WebP))
        .load()
        .whole(2)
        .images(1);
    textured("an image for browsers, and one for all")
        .set(
            "/textures/0/extensions",
            json!({"EXT_texture_webp": {"source": 9}}),
        )
        .load()
        .whole(2)
        .images(1);
}

#[test]
fn images_that_cannot_be_had_leave_the_constant() {
    for (path, value, word) in [
        ("/textures", json!([{}]), "it names no image"),
        ("/textures", Value::Null, "there is no such texture"),
        ("/textures/0/source", json!(7), "there is no image 7"),
        ("/images/0/uri", json!("none.png"), "texture none.png"),
        ("/images/0/uri", Value::Null, "it names no file"),
        ("/images/0", json!({"bufferView": 70}), "no buffer view 70"),
        (
            "/images/0/uri",
            json!("data:image/png;base64,*"),
            "cannot be decoded",
        ),
        (
            "/images/0/uri",
            json!("../tree.png"),
            "outside the model's folder; it is not there, either",
        ),
    ] {
        let case = textured(path).set(path, value);
        case.load()
            .but(2, &["drawn with the constant", word])
            .images(0)
            .color(PLAIN);
    }
    textured("-1 for no texture")
        .set(
            "/materials/0/pbrMetallicRoughness/baseColorTexture/index",
            json!(-1),
        )
        .load()
        .whole(2)
        .images(0)
        .color(PLAIN);
    textured("no coordinates")
        .set("/meshes/0/primitives/0/attributes/TEXCOORD_0", Value::Null)
        .load()
        .but(
            2,
            &[
                "lack the texture coordinates",
                "mesh 0 `square`, primitive 0",
            ],
        );
}

#[test]
fn images_are_found_however_they_are_named() {
    let encoded = STANDARD.encode(image(image::ImageFormat::Png));
    for uri in [
        format!("data:image/png;base64,{encoded}"),
        format!("data:image/jpeg;base64,{encoded}"),
        format!(
            "data:application/octet-stream;base64,{}",
            encoded.trim_end_matches('=')
        ),
        "wood.png".to_owned(),
        ".\\wood.png".to_owned(),
    ] {
        textured("a URI")
            .set("/images/0/uri", json!(uri))
            .load()
            .whole(2)
            .images(1);
    }
    for uri in [
        "C:\\Users\\me\\wood.png",
        "/home/me/wood.png",
        "Textures/wood.png",
    ] {
        textured("the path of another machine")
            .set("/images/0/uri", json!(uri))
            .load()
            .but(2, &["is not there: ", "wood.png is read"])
            .images(1);
    }
    textured("a sampler that is not there")
        .set("/textures/0/sampler", json!(4))
        .load()
        .whole(2);
}

#[test]
fn coordinates_of_textures_are_read_in_every_type() {
    let corners = || {
        CORNERS
            .as_flattened()
            .as_chunks::<3>()
            .0
            .iter()
            .flat_map(|[x, y, _]| [*x, *y])
    };
    let words = |most: f32| shorts(corners().map(|x| (x * most) as u16));
    let bytes = |most: f32| corners().map(|x| (x * most) as u8).collect::<Vec<_>>();
    let quantised = json!(["KHR_mesh_quantization"]);
    for (name, component, data, is_normalised, used, far) in [
        ("u16", 5123, words(65_535.0), true, json!([]), 1.0),
        ("u8", 5121, bytes(255.0), true, json!([]), 1.0),
        (
            "u16 of the standard itself",
            5123,
            words(65_535.0),
            false,
            json!([]),
            1.0,
        ),
        ("i16", 5122, words(32_767.0), true, quantised.clone(), 1.0),
        (
            "u16 as they are",
            5123,
            words(3.0),
            false,
            quantised.clone(),
            3.0,
        ),
        ("i8 as they are", 5120, bytes(3.0), false, quantised, 3.0),
    ] {
        let scene = textured(name)
            .accessor(data, component, "VEC2", 4)
            .set("/accessors/3/normalized", json!(is_normalised))
            .set("/extensionsUsed", used)
            .set("/meshes/0/primitives/0/attributes/TEXCOORD_0", json!(3))
            .load()
            .whole(2);
        assert_eq!(scene.scene().uvs[0][2], glam::Vec2::splat(far), "{name}");
    }
    textured("coordinates outside")
        .set("/accessors/2/count", json!(99))
        .load()
        .but(2, &["`TEXCOORD_0`, whose values are outside"]);
    let moved =
        json!({"KHR_texture_transform": {"offset": [0.5, null], "scale": [2, 2], "texCoord": 3}});
    textured("a transform of another set")
        .set(
            "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions",
            moved,
        )
        .set("/meshes/0/primitives/0/attributes/TEXCOORD_3", json!(2))
        .load()
        .whole(2)
        .images(1);
}

#[test]
fn surfaces_that_are_drawn_otherwise_are_named() {
    for name in [
        "KHR_materials_anisotropy",
        "KHR_materials_clearcoat",
        "KHR_materials_diffuse_transmission",
        "KHR_materials_dispersion",
        "KHR_materials_iridescence",
        "KHR_materials_sheen",
        "KHR_materials_specular",
        "KHR_materials_unlit",
    ] {
        case(name)
            .material(json!({"name": "shell", "extensions": {name: {}}}))
            .set("/extensionsRequired", json!([name]))
            .load()
            .but(2, &["1 material is extended by", name, "shell"]);
    }
    case("thin glass")
        .material(json!({"name": "pane", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {}}}))
        .load()
        .whole(2);
    case("half glass")
        .material(json!({"name": "pane", "extensions":
            {"KHR_materials_transmission": {"transmissionFactor": 0.4}}}))
        .load()
        .but(
            2,
            &[
                "1 material is transmissive",
                "drawn as if it were not",
                "pane",
            ],
        );
    case("most of glass")
        .material(json!({"name": "pane", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.75}}}))
        .load()
        .but(2, &["1 material is partly transmissive", "pane"]);
    for factors in [
        json!({"metallicFactor": 2}),
        json!({"roughnessFactor": -1}),
        json!({"metallicFactor": -0.5, "roughnessFactor": 0.5}),
    ] {
        case("factors beyond their range")
            .material(json!({"name": "odd", "pbrMetallicRoughness": factors}))
            .load()
            .but(2, &["beyond 0 to 1", "odd"]);
    }
    let unlit = case("unlit")
        .material(
            json!({"name": "sign", "extensions": {"KHR_materials_unlit": {}},
            "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 1]}}),
        )
        .load()
        .but(2, &["KHR_materials_unlit", "sign"])
        .color([0.5, 0.25, 1.0]);
    assert_eq!(unlit.scene().materials[0].kind, &crate::DIFFUSE);
    case("blended")
        .material(json!({"name": "veil", "alphaMode": "BLEND"}))
        .load()
        .whole(2);
    for (name, material) in [
        (
            "blended away",
            json!({"name": "air", "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 0]}}),
        ),
        (
            "cut away",
            json!({"name": "air", "alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 0.4]}}),
        ),
    ] {
        let told = [
            "1 material is wholly transparent",
            "nothing is drawn there: air",
        ];
        case(name).material(material).load().but(2, &told);
    }
    case("specular and gloss")
        .material(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness":
            {"diffuseFactor": [0.1, 0.2, 0.3, 1], "specularFactor": [0, 0, 0]}}}))
        .load()
        .whole(2)
        .color([0.1, 0.2, 0.3].map(|x| x / 0.96));
    // The roughness is 1 − gloss; that of the fallback's texture means nothing here.
    let glossy = textured("gloss besides a fallback")
        .set(
            "/materials/0/pbrMetallicRoughness/metallicRoughnessTexture",
            json!({"index": 0}),
        )
        .set(
            "/materials/0/extensions",
            json!({"KHR_materials_pbrSpecularGlossiness":
            {"specularFactor": [0, 0, 0], "glossinessFactor": 0.25}}),
        )
        .load()
        .whole(2)
        .images(0);
    let clear = textured("glass besides a fallback")
        .set(
            "/materials/0/pbrMetallicRoughness/metallicRoughnessTexture",
            json!({"index": 0}),
        )
        .set(
            "/materials/0/extensions",
            json!({"KHR_materials_transmission": {"transmissionFactor": 1},
            "KHR_materials_pbrSpecularGlossiness": {}}),
        )
        .load()
        .whole(2);
    assert_eq!(clear.scene().materials[0].kind, &crate::DIELECTRIC);
    let material = &glossy.scene().materials[0];
    assert_eq!(material.metallic_roughness_texture, None);
    assert_eq!(material.parameters[1], 0.75);
    let varied = json!({"specularFactor": [1, 1, 1], "specularGlossinessTexture": {"index": 0}});
    let fallback = textured("gloss of a texture")
        .set(
            "/materials/0/extensions",
            json!({"KHR_materials_pbrSpecularGlossiness": varied}),
        )
        .load()
        .but(
            2,
            &[
                "1 material is of varying gloss",
                "of the metallic-roughness model beside it: wood",
            ],
        )
        .color(PLAIN);
    let [metallic, roughness, _] = fallback.scene().materials[0].parameters[..] else {
        panic!("another kind")
    };
    assert_eq!((metallic, roughness), (0.0, 1.0));
    case("a short colour")
        .material(json!({"pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3], "metallicFactor": 0}}))
        .load()
        .whole(2)
        .color([0.1, 0.2, 0.3]);
    case("no such material")
        .set("/meshes/0/primitives/0/material", json!(7))
        .load()
        .but(
            2,
            &[
                "a material that is not there",
                "mesh 0 `square`, primitive 0",
            ],
        );
    case("a strange mode")
        .material(json!({"name": "lava", "alphaMode": "GLOW"}))
        .load()
        .but(2, &["unknown alpha mode", "drawn as opaque: lava"]);
}

/// The reflectance at normal incidence of a dielectric with these extensions.
fn reflectance(extensions: &Value) -> f32 {
    let material = json!({"name": "shell", "pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": extensions});
    let loaded = case("a reflectance").material(material).load();
    loaded.scene().materials[0].parameters[2]
}

#[test]
fn reflectances_are_those_of_the_index_times_the_specular_colour() {
    let ior = |ior: f32| json!({"KHR_materials_ior": {"ior": ior}});
    let both = |ior: f32, specular: Value| json!({"KHR_materials_ior": {"ior": ior}, "KHR_materials_specular": specular});
    let grey = |x: f32| json!({"specularColorFactor": [x, x, x]});
    for (extensions, expected) in [
        (json!({}), 0.04),
        (ior(2.0), 1.0 / 9.0),
        (ior(1.0), 0.0),
        // As the extension has it, for what was converted from specular-glossiness.
        (ior(0.0), 1.0),
        (both(0.0, grey(0.04)), 0.04),
        (both(1.5, grey(0.5)), 0.02),
        (both(1.5, json!({"specularFactor": 0.25})), 0.01),
        (
            both(
                1.5,
                json!({"specularFactor": 0.5, "specularColorFactor": [3, 1.5, 0]}),
            ),
            0.03,
        ),
        (both(2.0, json!({"specularColorFactor": [20, 20, 20]})), 1.0),
    ] {
        let found = reflectance(&extensions);
        assert!((found - expected).abs() < 1e-6, "{extensions}: {found}");
    }
}

#[test]
fn a_black_texture_leaves_no_light_and_the_sky_shines() {
    let black = image::RgbImage::new(2, 1);
    let mut bytes = std::io::Cursor::new(Vec::new());
    let png = image::ImageFormat::Png;
    black.write_to(&mut bytes, png).expect("an image");
    let glowing = |name| {
        textured(name)
            .set("/materials/0/emissiveFactor", json!([1, 1, 1]))
            .set("/materials/0/emissiveTexture", json!({"index": 0}))
    };
    let dark = glowing("a black emission")
        .file("wood.png", bytes.into_inner())
        .load();
    assert_eq!(dark.scene().materials[0].emission, Vec3::ZERO);
    assert!(dark.scene().daylight.is_some());
    let lit = glowing("an emission").load();
    assert!(lit.scene().materials[0].emission != Vec3::ZERO && lit.scene().daylight.is_none());
}
