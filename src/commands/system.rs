//! The machine: operating system, processor, and how a driver is installed there.

use raystone::measure::environment::cpu_model;
use std::fmt::Write as _;

/// Environment variables that change which adapter answers and how fast it is.
const VARIABLES: [(&str, &str); 5] = [
    (
        "WGPU_BACKEND",
        "the only backends to try: vulkan, gl, metal, dx12",
    ),
    (
        "VK_DRIVER_FILES",
        "Vulkan drivers to use instead of the installed ones",
    ),
    ("VK_ICD_FILENAMES", "the same, for older Vulkan loaders"),
    (
        "MESA_SHADER_CACHE_DIR",
        "where Mesa keeps compiled kernels from run to run",
    ),
    ("LP_NUM_THREADS", "threads of Mesa's software driver"),
];

/// Returns the variables with their values.
pub fn environment() -> String {
    let width = VARIABLES
        .iter()
        .map(|(name, _)| name.len())
        .max()
        .unwrap_or(0);
    let mut text = String::new();
    for (name, meaning) in VARIABLES {
        let value = std::env::var_os(name);
        let value = value.map_or("not set".to_owned(), |v| v.to_string_lossy().into_owned());
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {name:width$}  {value}  ({meaning})");
    }
    text
}

/// The relevant content of `/etc/os-release`.
#[derive(Debug, Default, PartialEq)]
pub struct System {
    /// Name and version, for people.
    pub name: String,
    /// `ID` and the families of `ID_LIKE`.
    families: Vec<String>,
    version: String,
}

impl System {
    /// Returns this system.
    pub fn this() -> Self {
        match std::fs::read_to_string("/etc/os-release") {
            Ok(text) => Self::parse(&text),
            Err(_) => Self {
                name: std::env::consts::OS.to_owned(),
                ..Self::default()
            },
        }
    }

    fn parse(os_release: &str) -> Self {
        let field = |name: &str| {
            let lines = os_release.lines();
            let mut values = lines.filter_map(|line| line.strip_prefix(name)?.strip_prefix('='));
            values
                .next()
                .unwrap_or_default()
                .trim_matches(['"', '\''])
                .to_owned()
        };
        let families = format!("{} {}", field("ID"), field("ID_LIKE"));
        Self {
            name: field("PRETTY_NAME"),
            families: families.split_whitespace().map(str::to_owned).collect(),
            version: field("VERSION_ID"),
        }
    }

    /// Returns `true` if `scripts/install-driver --backports` has a faster driver for this system.
    pub fn has_backports(&self) -> bool {
        self.families.first().is_some_and(|id| id == "debian") && self.version == "12"
    }

    /// Returns the line that installs a driver which runs on any processor.
    pub fn install_line(&self) -> &'static str {
        if cfg!(any(target_os = "macos", windows)) {
            return "(the driver comes with the system: update it)";
        }
        #[rustfmt::skip]
        let lines = [
            ("debian ubuntu", "sudo apt-get install --no-install-recommends mesa-vulkan-drivers libvulkan1"),
            ("fedora rhel", "sudo dnf install mesa-vulkan-drivers vulkan-loader"),
            ("arch", "sudo pacman -S vulkan-swrast vulkan-icd-loader"),
            ("suse opensuse opensuse-leap opensuse-tumbleweed", "sudo zypper install libvulkan_lvp libvulkan1"),
            ("alpine", "sudo apk add mesa-vulkan-swrast vulkan-loader"),
        ];
        let is_ours = |name: &str| self.families.iter().any(|family| family == name);
        let ours = lines
            .iter()
            .find(|(names, _)| names.split(' ').any(is_ours));
        ours.map_or(
            "(install Mesa's software Vulkan driver, lavapipe, and the Vulkan loader)",
            |(_, line)| line,
        )
    }
}

/// Returns the processor model and hardware threads.
pub fn processor() -> String {
    let model = cpu_model();
    match std::thread::available_parallelism() {
        Ok(threads) if threads.get() == 1 => format!("{model}, 1 thread"),
        Ok(threads) => format!("{model}, {threads} threads"),
        Err(_) => model,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_family_has_its_own_line() {
        for (os_release, tool) in [
            ("ID=debian\nVERSION_ID=\"12\"", "apt-get"),
            ("ID=linuxmint\nID_LIKE=\"ubuntu debian\"", "apt-get"),
            ("ID=\"rocky\"\nID_LIKE=\"rhel centos fedora\"", "dnf"),
            ("ID=arch", "pacman"),
            ("ID=\"opensuse-leap\"\nID_LIKE='suse opensuse'", "zypper"),
            ("ID=alpine", "apk"),
            ("ID=plan9", "lavapipe"),
        ] {
            let line = System::parse(os_release).install_line();
            assert!(line.contains(tool), "{os_release}: {line}");
        }
    }

    #[test]
    fn backports_are_offered_on_debian_12_alone() {
        let debian = |version| System::parse(&format!("ID=debian\nVERSION_ID=\"{version}\""));
        assert!(debian("12").has_backports());
        assert!(!debian("13").has_backports());
        assert!(!System::parse("ID=other\nID_LIKE=debian\nVERSION_ID=12").has_backports());
    }
}
