//! Images of the opacity in MTL.

use super::{SceneData, bc1, load_files};
use crate::AlphaChannel;

/// A model whose material has these statements; `leaf.png` and `leaf.tga` are this image.
fn masked(statements: &str, image: &[u8]) -> SceneData {
    let model = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    let library = format!("newmtl a\nKd 1 1 1\n{statements}\n");
    let files: [(&str, &[u8]); 4] = [
        ("a.obj", model),
        ("m.mtl", library.as_bytes()),
        ("leaf.png", image),
        ("leaf.tga", image),
    ];
    load_files(&files).expect(statements)
}

/// Channel, factor and cutoff of the mask of a material with these statements. Half of the image is dark, and of this alpha.
fn mask_of(statements: &str, alpha: u8) -> Option<(AlphaChannel, f32, Option<f32>)> {
    let texels = vec![20, 20, 20, alpha, 255, 255, 255, 255];
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_raw(2, 1, texels)
        .expect("two texels")
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("an image");
    let mask = masked(statements, &png.into_inner()).materials[0].mask?;
    Some((mask.channel, mask.factor, mask.cutoff))
}

#[test]
fn a_part_of_an_image_of_the_opacity_is_blended_and_all_of_it_cuts() {
    let cut = Some((AlphaChannel::Alpha, 1.0, Some(0.5)));
    for statements in [
        "map_d leaf.png",
        "d 1\nmap_d leaf.png",
        "Tr 0\nmap_d leaf.png",
    ] {
        assert_eq!(mask_of(statements, 0), cut, "{statements}");
    }
    // A cutoff of a half would leave nothing of the first and third, and all of the second.
    for (statements, factor) in [
        ("d 0.25\nmap_d leaf.png", 0.25),
        ("d 0.75\nmap_d leaf.png", 0.75),
        ("Tr 0.75\nmap_d leaf.png", 0.25),
        ("d 0.25\nmap_d gone.png", 0.25),
    ] {
        let mask = mask_of(statements, 0).map(|(_, factor, cutoff)| (factor, cutoff));
        assert_eq!(mask, Some((factor, None)), "{statements}");
    }
}

#[test]
fn dark_parts_of_an_image_of_the_colour_are_no_holes() {
    use AlphaChannel::{Alpha, Luminance};
    for (statements, alpha, channel) in [
        ("map_d leaf.png", 255, Some(Luminance)),
        ("map_Kd leaf.png\nmap_d leaf.png", 255, None),
        ("map_d .\\leaf.png\nmap_Kd -s 2 2 ./leaf.png", 255, None),
        (
            "map_Kd leaf.png\nmap_d -imfchan l leaf.png",
            255,
            Some(Luminance),
        ),
        ("map_Kd leaf.png\nmap_d leaf.png", 0, Some(Alpha)),
    ] {
        let found = mask_of(statements, alpha).map(|(channel, ..)| channel);
        assert_eq!(found, channel, "{statements}");
    }
}

#[test]
fn the_fourth_choice_of_bc1_is_a_hole_where_the_first_colour_is_not_above_the_second() {
    let [blue, red] = [0x001f, 0xf800];
    for has_late_header in [false, true] {
        for (colors, alpha) in [([blue, red], 0), ([red, red], 0), ([red, blue], 255)] {
            let dds = bc1(colors, [0xff, 0, 0, 0], has_late_header);
            let scene = masked("map_Kd leaf.png\nmap_d leaf.png", &dds);
            let [texture] = &scene.textures[..] else {
                panic!("{:?}", scene.report);
            };
            let alphas: Vec<u8> = texture.texels.iter().map(|[.., a]| *a).collect();
            assert_eq!(alphas[..4], [alpha; 4], "{colors:?}");
            assert_eq!(alphas[4..], [255; 12], "{colors:?}");
            assert_eq!(scene.materials[0].mask.is_some(), alpha == 0);
        }
    }
}

#[test]
fn alpha_of_a_tga_that_is_0_everywhere_is_none() {
    for (alphas, is_cut) in [([0, 0], false), ([0, 255], true), ([255, 255], false)] {
        let mut tga = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 32, 0];
        for alpha in alphas {
            tga.extend([200, 200, 200, alpha]);
        }
        let scene = masked("map_Kd leaf.tga\nmap_d leaf.tga", &tga);
        assert_eq!(scene.textures.len(), 1, "{:?}", scene.report);
        assert_eq!(scene.materials[0].mask.is_some(), is_cut, "{alphas:?}");
    }
}
