//! IES.

use crate::IesProfile;

/// The intensity straight down and at 45 degrees towards x and y, or a part of the error.
type Outcome = Result<[f64; 3], &'static str>;

/// A luminaire, what becomes of it, and a part of the note.
const IES: &[(&str, Outcome, &str)] = &[
    (
        "own measurement 12\nTILTED DOWNLIGHT, WHITE\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 40\n0 45 90\n0\n100 50 0\n",
        Ok([100.0, 50.0, 50.0]),
        "",
    ),
    (
        "IESNA91\ntilt = none\n1 1000 1 3 1 1 2 0 0 0 1 1 40 0 45 90 0 100 50 0\n\u{1a}",
        Ok([100.0, 50.0, 50.0]),
        "",
    ),
    (
        "IESNA91\nTILT=NONE\n1,1000,1,3,1,1,2,0,0,0\n1,1,40\n0,45,90\n0\n1.0E+02,0.5d2,0\n",
        Ok([100.0, 50.0, 50.0]),
        "",
    ),
    (
        "IESNA91\nTILT=a.tlt\n1 1000 1 3 1 1 2 0 0 0\n1 1 40\n0 45 90\n0\n100 50 0\n",
        Ok([100.0, 50.0, 50.0]),
        "line 2: factors for tilted lamps",
    ),
    (
        "IESNA91\nTILT=NONE\n1 -1 1 2 3 1 2 0 0 0\n1 1 0\n0 90\n180 270 360\n90 10 90 20 90 30\n",
        Ok([90.0, 60.0, 55.0]),
        "",
    ),
    (
        "IESNA91\nTILT=NONE\n1 -1 1 2 5 1 2 0 0 0\n1 1 0\n0 90\n-180 -90 0 90 180\n90 10 90 20 90 30 90 40 90 10\n",
        Ok([90.0, 60.0, 65.0]),
        "",
    ),
    (
        "IESNA91\nTILT=NONE\n1 -1 1 2 3 1 2 0 0 0\n1 1 0\n0 90\n-90 0 90\n90 10 90 30 90 20\n",
        Ok([90.0, 60.0, 55.0]),
        "",
    ),
    // The number that is kept for future use, below a label of no year.
    (
        "TILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 0 0\n0 90\n0\n90 30\n",
        Ok([90.0, 60.0, 60.0]),
        "",
    ),
    // Type B: the same from all sides, up to 90 degrees from straight ahead (x).
    (
        "IESNA91\nTILT=NONE\n1 -1 1 3 1 2 2 0 0 0\n1 1 0\n-90 0 90\n0\n10 90 30\n",
        Ok([90.0, 90.0, 60.0]),
        "line 6: there is one horizontal angle, 0; its intensities are taken for all",
    ),
    (
        "IESNA91\nTILT=NONE\n1 -1 1 2 2 2 2 0 0 0\n1 1 0\n0 90\n0 90\n90 30\n90 30\n",
        Ok([90.0, 90.0, 60.0]),
        "line 6: the vertical angles of a luminaire of type A or B begin at 0",
    ),
    (
        "IESNA91\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 0\n0 90\n0\n90 30\n7\n",
        Ok([90.0, 60.0, 60.0]),
        "line 8",
    ),
    (
        "IESNA91\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1,0 1,0 40\n0 45 90\n0\n100 50 0\n",
        Err("write decimals with a point"),
        "",
    ),
    (
        "IESNA91\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 40\n0 45 90\n0\n100 50\n",
        Err("line 7: the file ends where candela value 3 of 3"),
        "",
    ),
    (
        "IESNA91\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 40\n5 45 90\n0\n100 50 0\n",
        Err("line 5: vertical angles from 5 to 90"),
        "",
    ),
    (
        "IESNA91\nTILT=NONE\n1 1000 1 3 1 1 1 -1.5 2 0\n1 1 40\n0 45 90\n0\n100 50 0\n",
        Ok([100.0, 50.0, 50.0]),
        "line 3: the luminous opening of 1.5 × 2 × 0 feet",
    ),
    (
        "IESNA91\nTILT=NONE\n1 -1 1 3 2 2 2 0 0 0\n1 1 0\n-50 0 50\n0 50\n10 90 10 0 50 0\n\0\0",
        Ok([90.0, 54.0, 18.0]),
        "",
    ),
    (
        "IESNA91\nTILT=NONE\n1 -1 1 3 3 3 2 0 0 0\n1 1 0\n-20 0 20\n-20 0 20\n0 50 0 0 90 0 0 50 0\n",
        Ok([90.0, 0.0, 0.0]),
        "",
    ),
    (
        "IESNA91\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 40\n0 45 90\n0\n0 0 0\n",
        Ok([0.0, 0.0, 0.0]),
        "line 7: all candela values are 0",
    ),
    (
        "IESNA91\n1 1000 1 3 1 1 2 0 0 0\n",
        Err("there is no line `TILT=`"),
        "",
    ),
];

#[test]
fn ies_files_as_found_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.ies");
    for (text, expected, note) in IES {
        for end in ["\n", "\r\n", "\r"] {
            std::fs::write(&file, text.replace('\n', end)).expect("a file");
            match (IesProfile::read(&file), expected) {
                (Ok(found), Ok(intensities)) => {
                    for (x_y, intensity) in
                        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].iter().zip(intensities)
                    {
                        let towards = glam::DVec3::new(x_y[0], x_y[1], 1.0).normalize();
                        let error = found.intensity(towards) - intensity;
                        assert!(error.abs() < 1e-3, "{text}: {found:?}");
                    }
                    let told = found.warnings.join("; ");
                    assert!(
                        told.contains(note) && told.is_empty() == note.is_empty(),
                        "{text}: {told}"
                    );
                }
                (Err(error), Err(part)) => {
                    if part.contains("with a point") {
                        let advised = IesProfile::parse("", &text.replace(',', "."));
                        assert!(advised.is_ok(), "{text}: {advised:?}");
                    }
                    let error = error.to_string();
                    assert!(
                        error.contains(part) && !error.contains('\n'),
                        "{text}: {error}"
                    );
                }
                (result, expected) => panic!("{text}: {result:?} is no {expected:?}"),
            }
        }
    }
}
