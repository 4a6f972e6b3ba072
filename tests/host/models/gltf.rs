//! glTF and GLB.

use super::*;

#[test]
fn textures_are_reduced_aloud_or_left_out_as_the_options_say() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.glb");
    fs::write(&path, square_glb()).unwrap();
    let load_with = |textures, max_texture_size| {
        let options = LoadOptions {
            textures,
            max_texture_size,
            ..LoadOptions::default()
        };
        load(&variant(path.to_str().unwrap()), &options).unwrap()
    };
    let reduced = load_with(true, 1);
    assert_eq!(reduced.textures[0].texels.len(), 1);
    assert!(reduced.report.warnings[0].contains("from 2x1 to 1x1"));
    let plain = load_with(false, 1024);
    assert!(plain.textures.is_empty() && plain.uvs.is_empty());
    assert_eq!(plain.materials[0].base_color_texture, None);
    assert!(plain.report.warnings.is_empty());
}

#[test]
fn glb_nodes_are_flattened_with_their_transforms() {
    let scene = load_files("a.GLB", &[("a.GLB", &square_glb())]).unwrap();
    assert_eq!(scene.triangles.len(), 4);
    let far = scene.triangles[2].vertices[2];
    assert_eq!(far, Vec3::new(7.0, 2.0, 0.0));
    let camera = scene.camera.unwrap();
    assert_eq!(camera.eye, Vec3::new(0.0, 0.0, 7.0));
    assert!(
        (camera.target - camera.eye)
            .normalize()
            .distance(Vec3::NEG_Z)
            < 1e-6
    );
    assert!((camera.vertical_fov_degrees - 0.8_f32.to_degrees()).abs() < 1e-4);
    let lamp = &scene.materials[0];
    assert_eq!(lamp.emission, Vec3::new(4.0, 2.0, 0.0));
    assert_eq!(lamp.base_color, Vec3::new(0.5, 0.6, 0.7));
    assert_eq!(lamp.kind, &PRINCIPLED);
    assert_eq!(lamp.parameters[..2], [0.0, 1.0]);
    assert!((lamp.parameters[2] - 0.04).abs() < 1e-6);
    assert_eq!(scene.uvs[0][1], Vec2::new(1.0, 0.0));
    let placed = lamp.base_color_texture.unwrap();
    assert_eq!(
        placed.linear * Vec2::ONE + placed.offset,
        Vec2::new(2.25, 1.0)
    );
    assert!(!lamp.emits_both_sides, "not doubleSided");
    assert_eq!(scene.textures[0].width, 2);
}

#[test]
fn gltf_buffers_and_images_may_lie_in_files_or_data_uris() {
    use base64::Engine;
    let image = png();
    let bin = square_bin(&[]);
    let encoded = base64::engine::general_purpose::STANDARD.encode(&image);
    let json = square_json(0)
        .replace(
            "{\"byteLength\":92}",
            "{\"byteLength\":92,\"uri\":\"a%20b.bin\"}",
        )
        .replace(
            ",\n      {\"buffer\":0,\"byteOffset\":92,\"byteLength\":0}",
            "",
        )
        .replace(
            "{\"bufferView\":3,\"mimeType\":\"image/png\"}",
            &format!("{{\"uri\":\"data:image/png;base64,{encoded}\"}}"),
        );
    let files: &[(&str, &[u8])] = &[("a.gltf", json.as_bytes()), ("a b.bin", &bin)];
    let apart = load_files("a.gltf", files).unwrap();
    let whole = load_files("a.glb", &[("a.glb", &square_glb())]).unwrap();
    assert_eq!(apart.hash, whole.hash);
    let message = failure(load_files("a.gltf", &files[..1]));
    assert!(
        message.contains("buffer 0") && message.contains("a b.bin"),
        "{message}"
    );
}

#[test]
fn broken_gltf_files_say_which_part() {
    let image = png();
    let bin = square_bin(&image);
    let json = square_json(image.len());
    for (from, to, expected) in [
        (
            "\"count\":4,\"type\":\"VEC3\"",
            "\"count\":3,\"type\":\"VEC3\"",
            "vertex 3",
        ),
        ("\"count\":6", "\"count\":600", "mesh 0"),
        (
            "\"count\":4,\"type\":\"VEC3\"",
            "\"count\":4,\"type\":\"VEC2\"",
            "mesh 0",
        ),
        ("{\"mesh\":0}", "{}", ""),
    ] {
        assert!(json.contains(from), "{from}");
        let result = load_files("a.glb", &[("a.glb", &glb(&json.replace(from, to), &bin))]);
        match result {
            Ok(scene) => assert!(expected.is_empty() && scene.triangles.len() == 2, "{to}"),
            Err(error) => {
                let message = error.to_string();
                assert!(
                    !expected.is_empty() && message.contains(expected),
                    "{to}: {message}"
                );
            }
        }
    }
}

#[test]
fn nodes_that_share_a_mesh_become_instances_of_one_object() {
    let image = png();
    let bin = square_bin(&image);
    let json = square_json(image.len());
    let scene = load_files("a.glb", &[("a.glb", &glb(&json, &bin))]).unwrap();
    let assembly = scene.assembly.as_ref().unwrap();
    assert_eq!(assembly.objects().len(), 1);
    assert_eq!(assembly.instances().len(), 2);
    let copies = assembly.instances().iter().flat_map(|i| assembly.copy(i));
    assert!(copies.eq(scene.triangles.iter().copied()));
    assert!(scene.report.warnings.is_empty());
    // Used once, the mesh is no object; flattened by a node, it cannot be one.
    let once = json.replacen("{\"mesh\":0}", "{}", 1);
    let scene = load_files("a.glb", &[("a.glb", &glb(&once, &bin))]).unwrap();
    assert!(scene.assembly.is_none() && scene.report.warnings.is_empty());
    let flat = json.replacen("{\"mesh\":0}", "{\"mesh\":0,\"scale\":[1,0,1]}", 1);
    let scene = load_files("a.glb", &[("a.glb", &glb(&flat, &bin))]).unwrap();
    assert!(scene.assembly.is_none());
    let warning = &scene.report.warnings[0];
    assert!(warning.contains("cannot be inverted"), "{warning}");
}

/// The square with all textures that a material may have, and slanted normals.
#[test]
fn all_textures_and_the_normals_of_a_gltf_material_arrive() {
    let image = png();
    let mut bin = square_bin(&image);
    bin.resize(bin.len().next_multiple_of(4), 0);
    let first = bin.len();
    let normals = [
        [0.0_f32, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [0.0; 3],
    ];
    bin.extend(normals.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    let transform =
        "\"extensions\":{\"KHR_texture_transform\":{\"offset\":[0.5,0],\"rotation\":1.5707964}}";
    let json = square_json(image.len())
        .replace("\"TEXCOORD_0\":1}", "\"TEXCOORD_0\":1,\"NORMAL\":3}")
        .replace(
            "\"metallicFactor\":0,",
            "\"metallicFactor\":0.5,\"metallicRoughnessTexture\":{\"index\":1},",
        )
        .replace(
            "{\"name\":\"lamp\",",
            &format!(
                "{{\"name\":\"lamp\",\"doubleSided\":true,\"emissiveTexture\":{{\"index\":0,\"texCoord\":1}},\
                 \"normalTexture\":{{\"index\":1,\"scale\":0.5,{transform}}},"
            ),
        )
        .replace(
            "\"textures\":[{\"source\":0}]",
            "\"textures\":[{\"source\":0},{\"source\":0,\"sampler\":0}],\
             \"samplers\":[{\"wrapS\":33071,\"wrapT\":33648}]",
        )
        .replace(
            "\"type\":\"SCALAR\"}",
            "\"type\":\"SCALAR\"},{\"bufferView\":4,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}",
        )
        .replace(
            "}],\n    \"buffers\"",
            &format!("}},{{\"buffer\":0,\"byteOffset\":{first},\"byteLength\":48}}],\n    \"buffers\""),
        )
        .replace(
            &format!("\"buffers\":[{{\"byteLength\":{}}}]", 92 + image.len()),
            &format!("\"buffers\":[{{\"byteLength\":{}}}]", bin.len()),
        );
    let scene = load_files("a.glb", &[("a.glb", &glb(&json, &bin))]).unwrap();
    let lamp = &scene.materials[0];
    assert_eq!(lamp.kind, &PRINCIPLED);
    assert!(lamp.emits_both_sides);
    let varied = lamp.metallic_roughness_texture.unwrap();
    assert_eq!(varied.wrap, [Wrap::Clamp, Wrap::Mirrored]);
    let bent = lamp.normal_texture.unwrap();
    assert_eq!(bent.scale, 0.5);
    let turned = bent.linear * Vec2::X + bent.offset;
    assert!(turned.distance(Vec2::new(0.5, -1.0)) < 1e-6, "{turned}");
    assert_eq!(scene.textures.len(), 1, "one image, used three times");
    // The second instance is twice as large: its normals are not.
    assert_eq!(scene.normals.len(), 4);
    let slanted = decode_normal(scene.normals[2][1]).unwrap();
    assert!(slanted.distance(DVec3::new(0.5, 0.0, 0.5).normalize()) < 1e-4);
    assert_eq!(scene.normals[1][2], GEOMETRIC, "no length");
    // Its coordinate set is not that of the others.
    assert_eq!(lamp.emission_texture, None);
    let all = scene.report.warnings.join("\n");
    assert!(all.contains("several sets of coordinates"), "{all}");
}

#[test]
fn a_mask_takes_alpha_and_cutoff_of_the_base_colour_and_blending_is_told() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::RgbaImage::from_raw(2, 1, vec![9, 9, 9, 60, 9, 9, 9, 255]).unwrap();
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let image = bytes.into_inner();
    let load = |mode: &str, textures: bool| {
        let json = square_json(image.len())
            .replace(
                "\"baseColorFactor\":[0.5,0.6,0.7,1]",
                "\"baseColorFactor\":[0.5,0.6,0.7,0.8]",
            )
            .replace(
                "{\"name\":\"lamp\",",
                &format!("{{\"name\":\"lamp\",{mode}"),
            );
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("a.glb");
        fs::write(&path, glb(&json, &square_bin(&image))).unwrap();
        let options = LoadOptions {
            textures,
            ..LoadOptions::default()
        };
        raystone::scene::load(&variant(path.to_str().unwrap()), &options).unwrap()
    };
    let scene = load("\"alphaMode\":\"MASK\",\"alphaCutoff\":0.3,", true);
    let mask = scene.materials[0].mask.unwrap();
    assert_eq!((mask.factor, mask.cutoff), (0.8, Some(0.3)));
    assert_eq!(mask.texture, scene.materials[0].base_color_texture);
    assert!(
        mask.texture.unwrap().linear != glam::Mat2::IDENTITY,
        "its transform"
    );
    // Masks affect hits: they are loaded without textures, too.
    let bare = load("\"alphaMode\":\"MASK\",\"alphaCutoff\":0.3,", false);
    assert_eq!(bare.materials[0].mask, Some(mask));
    assert_eq!(bare.materials[0].base_color_texture, None);
    assert_eq!(bare.uvs.len(), bare.triangles.len());

    let default = load("\"alphaMode\":\"MASK\",", true);
    assert_eq!(default.materials[0].mask.unwrap().cutoff, Some(0.5));
    assert_eq!(load("", true).materials[0].mask, None);
    let low = load("\"alphaMode\":\"MASK\",\"alphaCutoff\":0.1,", true);
    assert_eq!(low.materials[0].mask, None, "no texel is below the cutoff");
    let blended = load("\"alphaMode\":\"BLEND\",", true);
    let mask = blended.materials[0].mask.unwrap();
    assert_eq!((mask.factor, mask.cutoff), (0.8, None));
    assert_eq!(mask.texture, blended.materials[0].base_color_texture);
    let hashes = [&scene.hash, &default.hash, &blended.hash];
    assert!(hashes[0] != hashes[1] && hashes[1] != hashes[2]);
}
