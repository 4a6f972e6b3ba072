//! OBJ and MTL.

use super::*;

#[test]
fn relative_indices_and_polygons_give_the_same_triangles_as_absolute_ones() {
    let absolute = load_obj(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
    let relative = load_obj(&format!("{SQUARE}f -4 -3 -2 -1\n")).unwrap();
    let triangles = load_obj(&format!("{SQUARE}f 1 2 3\nf 1 3 4\n")).unwrap();
    assert_eq!(absolute.triangles.len(), 2);
    assert_eq!(absolute.hash, relative.hash);
    assert_eq!(absolute.hash, triangles.hash);
    let turned = load_obj(&format!("{SQUARE}f 2 3 4 1\n")).unwrap();
    assert_ne!(absolute.hash, turned.hash);
}

#[test]
fn obj_materials_and_textures_arrive() {
    let mtl = b"newmtl wall\nKd 0.5 0.25 2\nmap_Kd -s 1 1 1 tex.png\nNs 10\nillum 2\n\
        newmtl lamp\nKe 3 2 1\nnewmtl mirror\nillum 5\nKd 0 0 0\nKs 0.9 0.8 0.7\n\
        newmtl glass\nillum 7\nNi 1.4\nTf 0.25 1 0.5625\nd 0.1\n\
        newmtl pane\nillum 2\nd 0.3\n";
    let obj = format!(
        "mtllib m.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 0.75\nusemtl wall\nf 1/1 2/2 3/3\n\
         usemtl lamp\nf 1 2 3\nusemtl mirror\nf 1 2 3\nusemtl glass\nf 1 2 3\n"
    );
    let image = png();
    let scene = load_files(
        "a.obj",
        &[
            ("a.obj", obj.as_bytes()),
            ("m.mtl", mtl),
            ("tex.png", &image),
        ],
    )
    .unwrap();
    let [wall, lamp, mirror, glass, pane] = &scene.materials[..] else {
        panic!("{:?}", scene.materials);
    };
    // Kd reflects twice the incoming light.
    assert_eq!(wall.base_color, Vec3::new(0.25, 0.125, 1.0));
    assert_eq!(wall.kind, &DIFFUSE);
    assert_eq!(wall.base_color_texture, Some(TextureUse::plain(0)));
    assert_eq!(
        scene.textures[0].texels,
        [[255, 0, 0, 255], [0, 0, 255, 255]]
    );
    let down = |u: f32, v: f32| Vec2::new(u, 1.0 - v);
    assert_eq!(
        scene.uvs[0],
        [down(0.0, 0.0), down(1.0, 0.0), down(1.0, 0.75)]
    );
    assert_eq!(lamp.emission, Vec3::new(3.0, 2.0, 1.0));
    assert_eq!(mirror.kind, &MIRROR);
    assert_eq!(mirror.base_color, Vec3::new(0.9, 0.8, 0.7));
    assert_eq!(glass.kind, &DIELECTRIC);
    assert_eq!(glass.parameters, [1.4, 0.0]);
    assert_eq!(glass.base_color, Vec3::new(0.5, 1.0, 0.75));
    assert_eq!(pane.kind, &DIFFUSE);
    let mask = pane.mask.expect("partly transparent");
    assert_eq!((mask.factor, mask.cutoff, mask.texture), (0.3, None, None));
    assert_eq!(glass.mask, None, "light passes through glass as it is");
    let [too_bright, unread] = &scene.report.warnings[..] else {
        panic!("{:?}", scene.report);
    };
    assert!(too_bright.contains("m.mtl: material `wall` reflects 2.0000 times"));
    assert!(unread.ends_with("`d` of glass (line 12)"), "{unread}");
    assert_eq!(scene.emitters(), [1]);
}

#[test]
fn a_highlight_makes_phong_and_metalness_a_principled_material() {
    let mtl = b"newmtl floor\nillum 2\nKd 0.5 0.5 0.5\nKs 0.25 0.25 0.25\nNs 20\nmap_Kd tex.png\n\
        newmtl glaring\nillum 2\nKd 1 1 1\nKs 1 1 1\nNs 3\n\
        newmtl dull\nillum 2\nKd 1 1 1\nKs 0 0 0\nNs 3\n\
        newmtl brass\nillum 2\nKd 0.8 0.6 0.2\nKs 0 0 0\nNs 3\nPm 1\nPr 0.25\n";
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl floor\nf 1 2 3\n");
    let image = png();
    let files: [(&str, &[u8]); 3] = [
        ("a.obj", obj.as_bytes()),
        ("m.mtl", mtl),
        ("tex.png", &image),
    ];
    let scene = load_files("a.obj", &files).unwrap();
    let [floor, glaring, dull, brass] = &scene.materials[..] else {
        panic!("{:?}", scene.materials);
    };
    assert_eq!((floor.kind, glaring.kind), (&PHONG, &PHONG));
    assert_eq!((dull.kind, brass.kind), (&DIFFUSE, &PRINCIPLED));
    assert_eq!(floor.base_color_texture, Some(TextureUse::plain(0)));
    assert_eq!(floor.parameters, [0.25, 0.25, 0.25, 20.0]);
    assert_eq!(glaring.base_color, Vec3::splat(0.5));
    assert_eq!(glaring.parameters, [0.5, 0.5, 0.5, 3.0]);
    assert_eq!(brass.parameters[..2], [1.0, 0.25]);
    let [warning, _sky] = &scene.report.warnings[..] else {
        panic!("{:?}", scene.report);
    };
    assert!(warning.contains("`glaring` reflects 2.0000"), "{warning}");
}

#[test]
fn a_missing_library_or_texture_is_a_warning() {
    let obj = format!("mtllib none.mtl\n{SQUARE}usemtl a\nf 1 2 3\n");
    let scene = load_obj(&obj).unwrap();
    assert!(scene.report.warnings[0].contains("none.mtl"));
    assert_eq!(scene.materials[0].base_color, Vec3::splat(DEFAULT_ALBEDO));

    let mtl = b"newmtl a\nKd 1 0 0\nmap_Kd none.png\n";
    let obj = obj.replace("none.mtl", "m.mtl");
    let scene = load_files("a.obj", &[("a.obj", obj.as_bytes()), ("m.mtl", mtl)]).unwrap();
    assert!(scene.report.warnings[0].contains("none.png"));
    assert_eq!(scene.materials[0].base_color_texture, None);
    assert!(scene.uvs.is_empty());
}

#[test]
fn broken_obj_files_say_the_line_and_what_is_wrong() {
    for (body, expected) in [
        (
            "f 1 2 9\n",
            "(line 5): the face refers to vertex 9, but there are 4",
        ),
        ("f 1 2 -5\n", "(line 5): the face refers to vertex -5"),
        ("f 1 2 0\n", "(line 5): the face refers to vertex 0"),
        ("f 1 2 x\n", "(line 5): `x` is not a face corner"),
        ("f 1 2 1.5\n", "(line 5): `1.5` is not a face corner"),
        ("f 1 2 .0\n", "(line 5): `.0` is not a face corner"),
        ("v 1 2\nf 1 2 5\n", "(line 5): `v` with 2 numbers"),
        ("v 1 2 x\nf 1 2 5\n", "(line 5): `x` is not a number"),
        ("", "no triangles"),
        ("p 1\nl 1 2\n", "no triangles"),
    ] {
        let message = failure(load_obj(&format!("{SQUARE}{body}")));
        assert!(message.contains(expected), "{message} lacks {expected}");
        assert!(message.contains("model.OBJ"), "{message}");
    }
}

#[test]
fn non_finite_triangles_are_dropped_and_flat_ones_kept_and_both_are_counted() {
    let body = "v nan 0 0\nv inf 0 0\nf 1 2 3\nf 1 2 5\nf 1 2 6\nf 1 1 2\n";
    let scene = load_obj(&format!("{SQUARE}{body}")).unwrap();
    assert_eq!(scene.triangles.len(), 2);
    assert_eq!(scene.report.dropped_non_finite, 2);
    assert_eq!(scene.report.zero_area, 1);
    let message = failure(load_obj("v nan 0 0\nf 1 1 1\n"));
    assert!(message.contains("all 1 have a NaN"), "{message}");
}

#[test]
fn coordinates_that_would_overflow_are_refused() {
    assert!(load_obj("v 9e8 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n").is_ok());
    let message = failure(load_obj("v 2e9 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"));
    assert!(message.contains("2e9"), "{message}");
}

#[test]
fn names_in_latin_1_do_not_stop_a_model() {
    let mut bytes = SQUARE.as_bytes().to_vec();
    bytes.extend(b"o T\xfcr\nf 1 2 3\n");
    let scene = load_files("a.obj", &[("a.obj", &bytes)]).unwrap();
    assert_eq!(scene.triangles.len(), 1);
}

#[test]
fn normals_are_kept_where_they_bend_the_surface() {
    let bent =
        format!("{SQUARE}vn 0 0 1\nvn 1 0 1\nvn 0 0 0\nf 1//1 2//2 3//3\nf 1//1 3//1 4//1\n");
    let scene = load_obj(&bent).unwrap();
    let [first, second] = &scene.normals[..] else {
        panic!("{:?}", scene.normals);
    };
    let slanted = decode_normal(first[1]).unwrap();
    assert!(slanted.distance(DVec3::new(0.5, 0.0, 0.5).normalize()) < 1e-4);
    assert_eq!((first[2], *second), (GEOMETRIC, [GEOMETRIC; 3]));
    // Flat ones, on either side, add nothing.
    let flat = format!("{SQUARE}vn 0 0 1\nvn 0 0 -3\nf 1//1 2//2 3//1 4//2\n");
    let without = load_obj(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
    let flat = load_obj(&flat).unwrap();
    assert!(flat.normals.is_empty());
    assert_eq!(flat.hash, without.hash);
    assert_ne!(scene.hash, without.hash);
}

#[test]
fn statements_place_textures_and_what_has_none_says_so() {
    let mtl = b"newmtl a\nKd 1 1 1\nmap_Kd -clamp on -s 2 2 -o 0.5 0 tex.png\nnorm -bm 0.5 tex.png\n\
        map_Ks tex.png\nmap_bump tex.png\nnewmtl lamp\nKe 1 1 1\nmap_Ke gone.png\nmap_bump tex.png\n";
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl lamp\nf 1 2 3\n");
    let image = png();
    let files: [(&str, &[u8]); 3] = [
        ("a.obj", obj.as_bytes()),
        ("m.mtl", mtl),
        ("tex.png", &image),
    ];
    let scene = load_files("a.obj", &files).unwrap();
    let [a, lamp] = &scene.materials[..] else {
        panic!("{:?}", scene.materials);
    };
    let color = a.base_color_texture.unwrap();
    assert_eq!(color.wrap, [Wrap::Clamp; 2]);
    assert_eq!(color.linear * Vec2::ONE + color.offset, Vec2::new(2.5, 1.0));
    assert_eq!(a.normal_texture.unwrap().scale, 0.5);
    assert_eq!(scene.textures.len(), 1);
    assert_eq!(lamp.emission, Vec3::ONE);
    assert_eq!(lamp.emission_texture, None, "the constant");
    let all = scene.report.warnings.join("\n");
    for expected in [
        "2 materials are shaped by a bump map",
        "1 material is shaped by map_Ks, which is not rendered yet; drawn as if it were not: a",
        "gone.png",
    ] {
        assert!(all.contains(expected), "{all} lacks {expected}");
    }
}

/// A 2 x 1 image whose first texel has this alpha and whose second is opaque white.
fn masked_png(alpha: u8, light: u8) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let texels = vec![light, light, light, alpha, 255, 255, 255, 255];
    let image = image::RgbaImage::from_raw(2, 1, texels).unwrap();
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// The mask of a square with these statements, and all warnings.
fn mask_of(statements: &str, image: &[u8]) -> (Option<AlphaMask>, String) {
    let mtl = format!("newmtl a\nKd 1 1 1\n{statements}\n");
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3\n");
    let files: [(&str, &[u8]); 3] = [
        ("a.obj", obj.as_bytes()),
        ("m.mtl", mtl.as_bytes()),
        ("leaf.png", image),
    ];
    let scene = load_files("a.obj", &files).unwrap();
    let mask = scene.materials[0].mask;
    let uvs = if mask.is_some() { 1 } else { scene.uvs.len() };
    assert_eq!(scene.uvs.len(), uvs);
    (mask, scene.report.warnings.join("\n"))
}

#[test]
fn the_texture_of_the_opacity_is_a_mask() {
    let (mask, warnings) = mask_of("d 0.75\nmap_d -clamp on leaf.png", &masked_png(0, 255));
    let mask = mask.unwrap();
    assert!(!warnings.contains("map_d"), "{warnings}");
    assert_eq!((mask.factor, mask.cutoff), (0.75, None));
    assert_eq!(mask.channel, AlphaChannel::Alpha);
    assert_eq!(mask.texture.unwrap().wrap, [Wrap::Clamp; 2]);

    let by_light = mask_of("map_d leaf.png", &masked_png(255, 20)).0.unwrap();
    assert_eq!(by_light.channel, AlphaChannel::Luminance);
    let named = mask_of("map_d -imfchan g leaf.png", &masked_png(0, 20));
    assert_eq!(named.0.unwrap().channel, AlphaChannel::Green);

    assert_eq!(mask_of("map_d leaf.png", &masked_png(200, 255)).0, None);
    for (text, image) in [
        ("map_d gone.png", masked_png(0, 0)),
        ("map_d leaf.png", vec![1, 2, 3]),
    ] {
        let (mask, warnings) = mask_of(text, &image);
        assert_eq!(mask, None);
        let file = text.rsplit(' ').next().unwrap();
        let told = warnings.lines().find(|line| line.contains(file));
        assert!(
            told.is_some_and(|line| line.contains("cuts out are whole")),
            "{warnings}"
        );
    }
}
