//! `raystone points`: the same points from host and adapter, as bytes and as pictures.

use super::{error, run, stdout, text};

#[test]
fn points_are_the_same_bytes_from_host_and_adapter() {
    let arguments = "points --sequence sobol --decorrelation owen-hash --count 100 --dims 0,3,2 --pixel 5,7 --seed 9";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let host = run(&arguments);
    let adapter = run(&[&arguments[..], &["--gpu"]].concat());
    assert_eq!(
        (host.status.code(), adapter.status.code()),
        (Some(0), Some(0))
    );
    assert_eq!(stdout(&host).lines().count(), 100);
    assert_eq!(stdout(&host), stdout(&adapter));
    let other = run(&[&arguments[..], &["--width", "200"]].concat());
    assert_ne!(
        stdout(&host),
        stdout(&other),
        "another width is another pixel"
    );

    let corput = run(&[
        "points",
        "--sequence",
        "van-der-corput",
        "--count",
        "3",
        "--dims",
        "0",
    ]);
    let expected = "0.0000000000000000e0\n5.0000000000000000e-1\n2.5000000000000000e-1\n";
    assert_eq!(stdout(&corput), expected);
    let third = [
        "points",
        "--sequence",
        "van-der-corput",
        "--count",
        "2",
        "--dims",
        "0",
        "--param",
        "base=3",
    ];
    assert!(stdout(&run(&third)).ends_with("3.3333333325572312e-1\n"));
}

#[test]
fn pictures_of_points_are_the_same_bytes_from_host_and_adapter() {
    let arguments = "points --sequence halton --decorrelation cranley-patterson --count 64 --dims 0,1,4 --seed 9 --copies 7";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let draw = |name: &str, more: &[&str]| {
        let to = folder.path().join("new").join(name);
        let drawn = run(&[&arguments[..], &["--plot", text(&to)], more].concat());
        assert_eq!(drawn.status.code(), Some(0), "{drawn:?}");
        assert!(
            stdout(&drawn).starts_with("page: "),
            "points are not printed"
        );
        to
    };
    let (host, adapter) = (draw("host", &[]), draw("adapter", &["--gpu"]));
    let page = std::fs::read_to_string(host.join("index.html")).expect("a page");
    for part in ["halton × cranley-patterson", "64 of 64 each", "7 pixels"] {
        assert!(page.contains(part), "{part}");
    }
    for name in [
        "point-set",
        "elementary-intervals",
        "projections",
        "pair-discrepancy",
        "pixels",
        "spectrum",
    ] {
        let [own, other] = [&host, &adapter].map(|folder| {
            let file = folder.join("plots").join(format!("{name}.svg"));
            std::fs::read(&file).expect("a picture")
        });
        assert!(own == other, "{name} differs");
        let png = image::open(host.join("plots").join(format!("{name}.png")));
        assert!(png.is_ok_and(|png| png.width() > 100), "{name}");
    }
}

#[test]
fn pictures_of_points_that_cannot_be_made_end_with_2_and_the_reason() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("a writable folder");
    let below = file.join("folder");
    for (arguments, piece) in [
        ("--count 4 --copies 0", "--copies"),
        ("--count 4 --dims 1", "2 to 16 dimensions"),
        ("--count 1048577", "1048576"),
        ("--count 4 --pixel 0,22369621 --copies 200", "fewer pixels"),
        ("--count 4", "cannot make the folder"),
    ] {
        let arguments: Vec<&str> = ["points", "--sequence", "sobol", "--plot", text(&below)]
            .into_iter()
            .chain(arguments.split(' '))
            .collect();
        let message = error(&run(&arguments), 2);
        assert!(message.contains(piece), "no `{piece}` in {message}");
    }
    let message = error(
        &run(&[
            "points",
            "--sequence",
            "sobol",
            "--count",
            "4",
            "--copies",
            "9",
        ]),
        2,
    );
    assert!(message.contains("required"), "{message}");
}

#[test]
fn points_beyond_a_limit_or_without_sense_end_with_2_and_the_limit_or_reason() {
    for (arguments, pieces) in [
        ("--sequence sobl --count 4", &["did you mean `sobol`"][..]),
        (
            "--sequence sobol --count 4 --decorrelation owen-hsh",
            &["`owen-hash`"],
        ),
        ("--sequence owen-sobol --count 65537", &["65537", "65536"]),
        ("--sequence halton --count 4 --dims 0,256", &["257", "256"]),
        (
            "--sequence halton --count 4 --decorrelation owen-hash",
            &["base 2"],
        ),
        (
            "--sequence halton --count 4 --param digit=faure",
            &["did you mean `digits`"],
        ),
        (
            "--sequence halton --count 4 --param digits=fore",
            &["`faure`"],
        ),
        (
            "--sequence halton --count 4 --param digits=faure,plain",
            &["one value"],
        ),
        (
            "--sequence halton --count 4 --pixel 192,0",
            &["192 pixels wide"],
        ),
        (
            "--sequence hammersley --count 4 --decorrelation index-offset",
            &["moves the index"],
        ),
    ] {
        let arguments: Vec<&str> = std::iter::once("points")
            .chain(arguments.split(' '))
            .collect();
        let message = error(&run(&arguments), 2);
        for piece in pieces {
            assert!(
                message.contains(piece),
                "{arguments:?}: no `{piece}` in {message}"
            );
        }
    }
}
