//! Printed digest values by scene, structure, method and samples.

use raystone::config::expect::{At, Compare, Expect, Pick};

/// Patterns of structures, and their names by Nilsson and Otte dag.
const STRUCTURES: [(&str, &str); 5] = [
    ("bvh*", "BVH"),
    ("roped-bvh*", "Stackless BVH"),
    ("object-list*", "Per-object BVH"),
    ("uniform-grid*", "Uniform grid"),
    ("irregular-grid*", "Irregular grid"),
];

struct Printed {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Printed {
    /// The first table after the first line with this text.
    fn new(text: &str, below: &str) -> Self {
        let (_, rest) = text
            .split_once(below)
            .unwrap_or_else(|| panic!("no {below}"));
        let lines = rest
            .lines()
            .skip(1)
            .skip_while(|line| !line.starts_with('|'));
        let cells = |line: &str| -> Vec<String> {
            let inner = line.trim().trim_matches('|');
            inner
                .split('|')
                .map(|c| c.trim().replace("**", ""))
                .collect()
        };
        let mut lines = lines.take_while(|line| line.starts_with('|')).map(cells);
        let columns = lines.next().expect("a head");
        let mut rows: Vec<Vec<String>> = lines.skip(1).collect();
        // An empty first cell repeats the one above.
        for i in 1..rows.len() {
            if rows[i][0].is_empty() {
                rows[i][0] = rows[i - 1][0].clone();
            }
        }
        Self { columns, rows }
    }

    fn number(&self, row: &[&str], column: usize) -> Option<f64> {
        let is_it = |cells: &&Vec<String>| {
            let pairs = row.iter().zip(cells.iter());
            pairs.into_iter().all(|(a, b)| a.eq_ignore_ascii_case(b))
        };
        let mut found = self.rows.iter().filter(is_it);
        let only = found.next().filter(|_| found.next().is_none())?;
        only[column]
            .split(' ')
            .next()?
            .replace(',', "")
            .parse()
            .ok()
    }

    fn at(&self, row: &[&str], column: &str) -> Option<f64> {
        let column = self.columns.iter().position(|c| c == column)?;
        self.number(row, column)
    }
}

/// The name for the pattern of a pick on an axis.
fn named<'n>(pick: &Pick, axis: &str, names: &[(&str, &'n str)]) -> Option<&'n str> {
    let pattern = pick.get(axis)?;
    let found = names.iter().find(|(known, _)| known == pattern);
    found.map(|(_, name)| *name)
}

/// A place with the picks of its expectation.
pub struct Place<'e> {
    expect: &'e Expect,
    pub at: &'e At,
    of: Pick,
    over: Pick,
}

impl<'e> Place<'e> {
    pub fn new(expect: &'e Expect, at: &'e At) -> Self {
        let laid = |base: &Pick, more: &Pick| -> Pick {
            let mut pick = base.clone();
            pick.extend(more.clone());
            pick
        };
        Self {
            of: laid(&expect.of, &at.of),
            over: laid(&expect.over, &at.over),
            expect,
            at,
        }
    }

    pub fn column(&self) -> &str {
        if self.at.column.is_empty() {
            &self.expect.column
        } else {
            &self.at.column
        }
    }

    fn on(&self) -> &str {
        self.at.on.as_deref().unwrap_or_default()
    }

    /// `value(of)`, over `value(over)` for a ratio.
    fn quotient(&self, value: impl Fn(&Pick) -> Option<f64>) -> Option<f64> {
        match self.expect.compare {
            Compare::Ratio => Some(value(&self.of)? / value(&self.over)?),
            _ => value(&self.of),
        }
    }

    /// The digest's label and number for this place; `None` if it prints nothing.
    pub fn printed(&self, name: &str, text: &str) -> Option<(String, f64)> {
        match name {
            "nilsson-table-5-2" => self.nilsson_5_2(text),
            "nilsson-table-5-3" => self.nilsson_5_3(text),
            "nilsson-table-5-4" => self.nilsson_5_4(text),
            "dufay-table-2-2" => self.dufay_2_2(text),
            "dufay-tables-3-2-to-3-5" => self.dufay_3(text),
            "dufay-h3b-path-depth" => self.depth(text),
            "dufay-table-4-1" => self.dufay_4_1(text),
            "dufay-table-4-2" => self.dufay_4_2(text),
            "dufay-table-5-1" => self.dufay_5_1(text),
            "dufay-fig-5-14" => self.fit(text, "Halton"),
            "dufay-fig-5-15" => self.fit(text, "Hammersley"),
            "roger-stream-reduction" => self.roger(text),
            "pfeuti-tables-4-1-to-4-5" => self.pfeuti(text),
            _ => None,
        }
    }

    /// The printed factor, computed from unrounded numbers, if the quotient agrees.
    fn factor(&self, printed: Option<f64>, value: impl Fn(&Pick) -> Option<f64>) -> Option<f64> {
        let (printed, value) = (printed?, self.quotient(value)?);
        ((value / printed - 1.0).abs() < 0.02).then_some(printed)
    }

    fn nilsson_5_2(&self, text: &str) -> Option<(String, f64)> {
        let table = Printed::new(text, "**Table 5.2**");
        let column = match &*self.expect.figure {
            "ms-per-spp/v1" => "ms",
            "cell-mrays-per-s/v1" => "Mrays/s",
            "mrays-per-s/v1" if self.of.get("rays")? == "primary" => "primary",
            _ => return None,
        };
        let value =
            |pick: &Pick| table.at(&[self.on(), named(pick, "accel", &STRUCTURES)?], column);
        let name = |pick| named(pick, "accel", &STRUCTURES);
        let is_ratio = self.expect.compare == Compare::Ratio;
        let row = match (self.at.of.is_empty(), self.at.over.is_empty()) {
            (true, true) => self.on().to_owned(),
            (false, false) if is_ratio => {
                format!(
                    "{} · {} over {}",
                    self.on(),
                    name(&self.of)?,
                    name(&self.over)?
                )
            }
            _ => format!("{} · {}", self.on(), name(&self.of)?),
        };
        Some((row, self.quotient(value)?))
    }

    fn nilsson_5_3(&self, text: &str) -> Option<(String, f64)> {
        let table = Printed::new(text, "**Table 5.3**");
        let names = [
            ("pixel-hash", "Mrays/s"),
            ("pixel-hash(seeding=sample)", "coherent"),
        ];
        let speed = |pick: &Pick| table.at(&[self.on()], named(pick, "sequence", &names)?);
        let value = match &*self.expect.figure {
            "cell-mrays-per-s/v1" => self.quotient(speed)?,
            // Cycles are the inverse of a speed.
            "cycles-per-path/v1" => self.quotient(|pick| Some(1.0 / speed(pick)?))?,
            _ => return None,
        };
        Some((self.on().to_owned(), value))
    }

    fn nilsson_5_4(&self, text: &str) -> Option<(String, f64)> {
        let table = Printed::new(text, "**Table 5.4**");
        let scenes = [("Cornell Box", "Cornell"), ("Crytek Sponza", "Sponza")];
        let scene = scenes.iter().find(|(ours, _)| *ours == self.on());
        let scene = scene.map_or(self.on(), |(_, theirs)| theirs);
        let short = |name: &str| name.trim_end_matches(" BVH").to_owned();
        let value = |pick: &Pick| table.at(&[&short(named(pick, "accel", &STRUCTURES)?)], scene);
        let is_time = self.expect.figure == "build-ms/v1";
        let row = match self.expect.compare {
            Compare::Ratio => self.on(),
            _ if self.column() == self.on() => named(&self.of, "accel", &STRUCTURES)?,
            _ => return None,
        };
        Some((row.to_owned(), self.quotient(value).filter(|_| is_time)?))
    }

    fn dufay_2_2(&self, text: &str) -> Option<(String, f64)> {
        let table = Printed::new(text, "## 3.1 Table 2.2");
        // Frames per second, and seconds.
        let columns = [
            ("one-pass", (2, 3)),
            ("blocks", (4, 5)),
            ("quad-tree", (7, 8)),
        ];
        let column = |pick: &Pick| {
            let order = pick.get("subject")?;
            columns
                .iter()
                .find(|(name, _)| name == order)
                .map(|(_, at)| *at)
        };
        let of = |column| table.number(&[self.on()], column);
        let value = match &*self.expect.figure {
            "order-ms/v1" => {
                self.factor(of(column(&self.of)?.1 + 1), |pick| of(column(pick)?.1))?
            }
            "first-picture-ms/v1" => self.quotient(|pick| Some(1.0 / of(column(pick)?.0)?))?,
            _ => return None,
        };
        Some((self.on().to_owned(), value))
    }

    fn dufay_3(&self, text: &str) -> Option<(String, f64)> {
        if self.expect.figure == "ray-query-share/v1" {
            let share = text.contains("| up to 95 % | ch. 4 |").then_some(95.0);
            return Some((
                self.on().to_owned(),
                share.filter(|_| self.expect.unit == "%")?,
            ));
        }
        let (number, _) = self.column().split_once(':')?;
        let table = Printed::new(text, &format!("**Table {number}"));
        let with_roulette = matches!(number, "3.4" | "3.5");
        let (_, heading) = text.split_once(&format!("**Table {number}"))?;
        let heading = heading.lines().next()?;
        assert_eq!(
            heading.contains("with Russian roulette"),
            with_roulette,
            "{heading}"
        );
        let gpu = self.column().split_once(": ")?.1;
        assert!(heading.contains(gpu), "{heading}: {gpu}");
        let organisation = [("single-kernel", "SK (s)"), ("multi-kernel", "MK (s)")];
        let row = match (self.on(), with_roulette) {
            ("Rungholt", true) => "Rungholt 100 Lights",
            ("San Miguel", _) => "San Miguel (7 bounces)",
            (name, _) => name,
        };
        let value = |pick: &Pick| {
            let depth = pick.get("integrator")?;
            let roulette = if with_roulette { "albedo" } else { "none" };
            let is_his = *depth == format!("path(*max_depth=7*roulette={roulette}*");
            table
                .at(&[row], named(pick, "organisation", &organisation)?)
                .filter(|_| is_his)
        };
        let factor = match number {
            // Two of them are swapped in print.
            "3.4" => "Factor (computed)",
            _ => "Factor",
        };
        Some((
            self.on().to_owned(),
            self.factor(table.at(&[row], factor), value)?,
        ))
    }

    /// The factor at the depth below over that at the depth above: times are MK over SK.
    fn depth(&self, text: &str) -> Option<(String, f64)> {
        let row = &*self.at.row;
        let tables = [("GTX 570", "3.4"), ("Titan X", "3.5")];
        let (_, number) = tables.iter().find(|(gpu, _)| *gpu == row)?;
        let table = Printed::new(text, &format!("**Table {number}"));
        let factor = |pick: &Pick| {
            let depths = [("path(max_depth=3,*", "3"), ("path(max_depth=7,*", "7")];
            let depth = named(pick, "integrator", &depths)?;
            let scene = format!("{} ({depth} bounces)", self.on());
            let at = |column| table.at(&[&scene], column);
            Some(at("MK (s)")? / at("SK (s)")?)
        };
        Some((row.to_owned(), self.quotient(factor)?))
    }

    fn dufay_4_1(&self, text: &str) -> Option<(String, f64)> {
        let table = Printed::new(text, "## 3.3 Table 4.1");
        let names = [
            ("object-list*", "Mrays/s meta off"),
            ("meta-bvh*", "Mrays/s meta on"),
        ];
        let factor = "Factor printed (computed)";
        let column = |pick: &Pick| named(pick, "accel", &names);
        let rays = self.of.get("rays").is_some_and(|rays| rays == "bounce");
        let value = match (&*self.expect.figure, self.expect.compare) {
            ("mrays-per-s/v1", Compare::Shown) => table.at(&[self.on()], column(&self.of)?),
            ("mrays-per-s/v1", Compare::Ratio) => {
                let printed = table.at(&[self.on()], factor);
                self.factor(printed, |pick| table.at(&[self.on()], column(pick)?))
            }
            _ => None,
        };
        Some((self.on().to_owned(), value.filter(|_| rays)?))
    }

    fn dufay_4_2(&self, text: &str) -> Option<(String, f64)> {
        let table = Printed::new(text, "## 3.4 Table 4.2");
        let names = [
            ("bvh(*traversal=parent-pointer*", "BVH Mrays/s"),
            ("bvh(*traversal=roped*", "Roped Mrays/s"),
        ];
        let value = |pick: &Pick| {
            let is_bounce = pick.get("rays").is_some_and(|rays| rays == "bounce");
            table
                .at(&[self.on()], named(pick, "accel", &names)?)
                .filter(|_| is_bounce)
        };
        let value = match &*self.expect.figure {
            "mrays-per-s/v1" if self.expect.compare == Compare::Shown => value(&self.of)?,
            "mrays-per-s/v1" => self.factor(table.at(&[self.on()], "Factor"), value)?,
            // Nodes are compared inversely: fewer of them are faster.
            "nodes-per-ray/v1" => self.factor(table.at(&[self.on()], "Factor"), |pick| {
                Some(1.0 / value(pick)?)
            })?,
            _ => return None,
        };
        Some((self.on().to_owned(), value))
    }

    fn dufay_5_1(&self, text: &str) -> Option<(String, f64)> {
        let table = Printed::new(text, "## 3.6 Table 5.1");
        let sequences = [("halton*", "Halton"), ("hammersley*", "Hammersley")];
        let shifts = [
            ("cranley-patterson", "CP"),
            ("micro-jitter", "micro-jitter"),
        ];
        let column = |pick: &Pick| {
            let sequence = named(pick, "sequence", &sequences)?;
            Some(format!(
                "{sequence} {}",
                named(pick, "decorrelation", &shifts)?
            ))
        };
        if self.expect.figure != "rmse-unbiased/v1" {
            return None;
        }
        if self.expect.compare == Compare::Slope {
            let column = column(&self.of)?;
            let points = ["8", "16", "32", "64", "128", "256", "512"].map(|spp| {
                let y = table.at(&[spp], &column).expect("a number");
                (spp.parse().expect("a number"), y)
            });
            let slope = raystone::measure::statistics::log_log_fit(&points)?;
            return Some((self.at.row.clone(), (100.0 * slope).round() / 100.0));
        }
        let spp = self.of.get("spp")?;
        let value = |pick: &Pick| table.at(&[pick.get("spp")?], &column(pick)?);
        let (row, is_column) = match self.expect.compare {
            Compare::Ratio => (format!("{spp} spp"), true),
            _ => (spp.clone(), column(&self.of)? == self.column()),
        };
        Some((row, self.quotient(value).filter(|_| is_column)?))
    }

    /// The thesis' fit `K/√N`, and its exponent.
    fn fit(&self, text: &str, sequence: &str) -> Option<(String, f64)> {
        if self.expect.figure == "star-exponent/v1" {
            return Some(("exponent".to_owned(), -0.5));
        }
        let (_, fit) = text.split_once(&format!("| {sequence} | `f(N)="))?;
        let k: f64 = fit.split('/').next()?.parse().ok()?;
        let is_his = *self.of.get("sequence")? == format!("{}*", sequence.to_lowercase());
        let n = self.of.get("points").filter(|_| is_his)?;
        Some((n.clone(), k / n.parse::<f64>().ok()?.sqrt()))
    }

    /// Tables 4.1 (a list a row) and 4.2 (a pass a row, both pipelines), of the thesis's 512² photons and 128³ voxels.
    fn pfeuti(&self, text: &str) -> Option<(String, f64)> {
        let label = self.of.get("integrator")?;
        let is_adaptive = label.contains("mode=adaptive");
        let size = if is_adaptive {
            "photons=256,"
        } else {
            "photons=512,"
        };
        if !label.contains(size) || !label.contains("side=*") {
            return None;
        }
        if self.expect.id == "table-4-1" {
            let column = label.contains("order=column");
            let order = if column { "column" } else { "row" };
            let row = match label
                .split(['(', ','])
                .find(|part| part.starts_with("points="))
            {
                None => "Hammersley".to_owned(),
                Some("points=halton") => "Halton".to_owned(),
                Some("points=random") => "Random".to_owned(),
                Some("points=grid") => format!("Grid ({order} first)"),
                Some("points=jitter") => format!("Jittering ({order} first)"),
                Some(_) => return None,
            };
            let table = Printed::new(text, "### 3.3 E2");
            let value = table.at(&[&row], "Photon marching")?;
            return Some((row, value));
        }
        let row = match &*self.expect.figure {
            "photon-pilots-ms/v1" => "Pilot photon marching",
            "photon-march-ms/v1" => "Photon marching",
            "photon-count/v1" => "Photon count",
            _ => return None,
        };
        let column = if is_adaptive { "Adaptive" } else { "Reference" };
        let table = Printed::new(text, "**Table 4.2, sphere**");
        let value = (self.column() == column).then(|| table.at(&[row], column))??;
        Some((row.to_owned(), value))
    }

    fn roger(&self, text: &str) -> Option<(String, f64)> {
        let method = self.of.get("integrator")?;
        // A million is the default, and not in the name.
        let sizes = [
            ("elements=262144,", "256 k"),
            ("elements=4194304,", "4 M"),
            ("elements=16777216,", "16 M"),
        ];
        let size = |method: &str| {
            sizes
                .iter()
                .find(|(n, _)| method.contains(n))
                .map_or("1 M", |(_, row)| row)
        };
        let row = match (self.expect.compare, self.over.get("integrator")) {
            (Compare::Ratio, Some(over)) if self.expect.figure == "compaction-ratio/v1" => {
                format!("{} over {}", size(method), size(over))
            }
            _ => size(method).to_owned(),
        };
        let ratios = Printed::new(text, "**Figure 4.16");
        let methods = [
            ("compaction:horn(", "Horn"),
            ("compaction:blelloch(", "Blelloch-Horn"),
            ("compaction:reduce-scan-scatter(", "CUDA (scan only)"),
        ];
        let of = |method: &str| methods.iter().find(|(start, _)| method.starts_with(start));
        let times = Printed::new(text, "**Figure 4.17");
        let value = match (&*self.expect.figure, &*self.expect.id) {
            ("compaction-ratio/v1", _) if self.expect.compare == Compare::Ratio => {
                let ratio = |pick: &Pick| {
                    let method = pick.get("integrator")?;
                    ratios.at(&[size(method)], of(method)?.1)
                };
                self.quotient(ratio)
            }
            ("compaction-ratio/v1", _) if method.starts_with("compaction:bucket-sort(") => {
                let buckets = if method.contains("buckets=9") {
                    "9 buckets"
                } else {
                    "4 buckets"
                };
                let is_column = buckets == self.column();
                let at = |column| times.at(&[&row], column);
                Some(at(buckets).filter(|_| is_column)? / at("reduction")?)
            }
            ("compaction-ratio/v1", _) => {
                let column = of(method)?.1;
                ratios
                    .at(&[&row], column)
                    .filter(|_| column == self.column())
            }
            // A fifth saved.
            ("compaction-ns/v1", "adaptive") if text.contains("save ≈ 20 %") => {
                Some(1.0 / (1.0 - 0.2))
            }
            _ => None,
        };
        Some((row, value?))
    }
}
