//! Intel's Embree, version 3 or 4, if its library is found at run time, with the required
//! declarations of `rtcore_ray.h`, `rtcore_scene.h`, `rtcore_geometry.h`. Scenes are robust
//! (`RTC_SCENE_FLAG_ROBUST`).

use super::native::Caster;
use super::{BuiltPeer, Peer};
use libloading::{Library, Symbol};
use raystone_accel::mask::is_cut_out;
use raystone_accel::{Hit, NO_HIT, Query, Ray, TriangleSoup};
use raystone_core::clock::Instant;
use raystone_gpu::Gpu;
use std::ffi::{c_int, c_void};
use std::mem::ManuallyDrop;
use std::ptr::{null, null_mut};

/// Library names, newest first, with major version.
const NAMES: [(&str, u32); 6] = [
    ("libembree4.so.4", 4),
    ("libembree4.so", 4),
    ("libembree3.so.3", 3),
    ("libembree3.so", 3),
    ("embree4.dll", 4),
    ("libembree4.dylib", 4),
];
/// `RTC_INVALID_GEOMETRY_ID`.
const INVALID: u32 = u32::MAX;
const TRIANGLES: c_int = 0;
const INDICES: c_int = 0;
const VERTICES: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const ROBUST: c_int = 4;
const HIGH_QUALITY: c_int = 2;
/// `RTC_DEVICE_PROPERTY_VERSION`.
const VERSION: c_int = 0;

/// `RTCRayHit`, which begins with an `RTCRay`.
#[repr(C, align(16))]
struct RayHit {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instance: u32,
    /// `instPrimID` of version 4.1; otherwise padding.
    instance_primitive: u32,
}

/// `RTCIntersectContext` of version 3.
#[repr(C)]
struct Context {
    flags: c_int,
    filter: *const c_void,
    instance: [u32; 2],
}

/// `RTCFilterFunctionNArguments`.
#[repr(C)]
struct FilterArguments {
    valid: *mut c_int,
    user: *const c_void,
    context: *const c_void,
    ray: *const FilteredRay,
    hit: *const FilteredHit,
    count: u32,
}

/// The beginning of `RTCRay`.
#[repr(C)]
struct FilteredRay {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
}

/// `RTCHit` of a single ray.
#[repr(C)]
struct FilteredHit {
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
}

/// Rejects hits where a mask cuts out the surface. `user` is the soup.
unsafe extern "C" fn filter(arguments: *const FilterArguments) {
    // SAFETY: Embree passes one ray with one hit, and the geometry's soup, which outlives it.
    unsafe {
        let arguments = &*arguments;
        let soup = &*arguments.user.cast::<TriangleSoup>();
        let hit = &*arguments.hit;
        let record = &soup.records[hit.primitive as usize];
        let ray = &*arguments.ray;
        let asked = soup.intersection.raised(&Ray {
            origin: ray.origin,
            t_min: ray.t_near,
            direction: ray.direction,
            t_max: ray.t_far,
        });
        if is_cut_out(soup.masks.as_deref(), record, &asked, [hit.u, hit.v]) {
            *arguments.valid = 0;
        }
    }
}

/// The functions called per ray.
#[derive(Clone, Copy)]
enum Cast {
    Three {
        nearest: unsafe extern "C" fn(*mut c_void, *mut Context, *mut RayHit),
        any: unsafe extern "C" fn(*mut c_void, *mut Context, *mut RayHit),
    },
    Four {
        nearest: unsafe extern "C" fn(*mut c_void, *mut RayHit, *const c_void),
        any: unsafe extern "C" fn(*mut c_void, *mut RayHit, *const c_void),
    },
}

impl Cast {
    /// Looks the functions up.
    ///
    /// # Safety
    /// The library is Embree's, of this major version.
    unsafe fn of(library: &Library, major: u32) -> Result<Self, libloading::Error> {
        // SAFETY: as promised by the caller, the signatures are those of the version's headers.
        unsafe {
            Ok(match major {
                3 => Self::Three {
                    nearest: *library.get(b"rtcIntersect1")?,
                    any: *library.get(b"rtcOccluded1")?,
                },
                _ => Self::Four {
                    nearest: *library.get(b"rtcIntersect1")?,
                    any: *library.get(b"rtcOccluded1")?,
                },
            })
        }
    }
}

pub(super) struct Embree;

struct Built<'a> {
    /// Never unloaded: its threads wait for work as long as the program runs.
    library: ManuallyDrop<Library>,
    cast: Cast,
    device: *mut c_void,
    scene: *mut c_void,
    version: isize,
    build_ms: f64,
    /// Read by the filter: must stay alive and in place.
    _soup: &'a TriangleSoup,
}

// SAFETY: a committed scene may be queried by many threads at once.
unsafe impl Sync for Built<'_> {}

impl Peer for Embree {
    fn name(&self) -> &'static str {
        "embree"
    }

    fn description(&self) -> &'static str {
        "Intel's Embree 3 or 4, robust, high build quality, if its library is found, on the host"
    }

    fn build<'a>(
        &self,
        _gpu: &Gpu,
        soup: &'a TriangleSoup,
    ) -> Result<Box<dyn BuiltPeer + 'a>, String> {
        // SAFETY: Embree's library has no constructors with requirements.
        let found = NAMES.iter().find_map(|(name, major)| {
            let library = unsafe { Library::new(name) }.ok()?;
            Some((library, *major))
        });
        let (library, major) = found.ok_or(
            "its library is not found: install libembree3 or libembree4 (Debian: `apt-get install libembree4-4` or \
             `libembree3-3`), or add its folder to LD_LIBRARY_PATH",
        )?;
        // SAFETY: the signatures match the headers of this major version.
        let built = unsafe { build(library, major, soup) };
        Ok(Box::new(built.map_err(|e| e.to_string())?))
    }
}

/// # Safety
/// `library` is Embree of this major version.
unsafe fn build(
    library: Library,
    major: u32,
    soup: &TriangleSoup,
) -> Result<Built<'_>, libloading::Error> {
    type New = unsafe extern "C" fn(*const c_void) -> *mut c_void;
    type NewGeometry = unsafe extern "C" fn(*mut c_void, c_int) -> *mut c_void;
    type NewBuffer =
        unsafe extern "C" fn(*mut c_void, c_int, u32, c_int, usize, usize) -> *mut c_void;
    type Set = unsafe extern "C" fn(*mut c_void, c_int);
    type SetPointer = unsafe extern "C" fn(*mut c_void, *const c_void);
    type Act = unsafe extern "C" fn(*mut c_void);
    type Attach = unsafe extern "C" fn(*mut c_void, *mut c_void) -> u32;
    type Property = unsafe extern "C" fn(*mut c_void, c_int) -> isize;
    // SAFETY: as promised by the caller; buffers have the stated lengths.
    unsafe {
        let get = |name: &str| -> Result<Symbol<'_, Act>, libloading::Error> {
            library.get(name.as_bytes())
        };
        let cast = Cast::of(&library, major)?;
        let new_device: Symbol<New> = library.get(b"rtcNewDevice")?;
        let new_scene: Symbol<New> = library.get(b"rtcNewScene")?;
        let new_geometry: Symbol<NewGeometry> = library.get(b"rtcNewGeometry")?;
        let new_buffer: Symbol<NewBuffer> = library.get(b"rtcSetNewGeometryBuffer")?;
        let scene_flags: Symbol<Set> = library.get(b"rtcSetSceneFlags")?;
        let scene_quality: Symbol<Set> = library.get(b"rtcSetSceneBuildQuality")?;
        let attach: Symbol<Attach> = library.get(b"rtcAttachGeometry")?;
        let property: Symbol<Property> = library.get(b"rtcGetDeviceProperty")?;

        let device = new_device(null());
        let start = Instant::now();
        let scene = new_scene(device);
        scene_flags(scene, ROBUST);
        scene_quality(scene, HIGH_QUALITY);
        let geometry = new_geometry(device, TRIANGLES);
        let count = soup.records.len();
        let vertices =
            new_buffer(geometry, VERTICES, 0, FLOAT3, 12, 3 * count).cast::<[[f32; 3]; 3]>();
        let indices = new_buffer(geometry, INDICES, 0, UINT3, 12, count).cast::<[u32; 3]>();
        for (place, record) in soup.records.iter().enumerate() {
            vertices.add(place).write(record.vertices());
            let first = 3 * place as u32;
            indices.add(place).write([first, first + 1, first + 2]);
        }
        if soup.masks.is_some() {
            let user: Symbol<SetPointer> = library.get(b"rtcSetGeometryUserData")?;
            let nearest: Symbol<SetPointer> =
                library.get(b"rtcSetGeometryIntersectFilterFunction")?;
            let any: Symbol<SetPointer> = library.get(b"rtcSetGeometryOccludedFilterFunction")?;
            user(geometry, std::ptr::from_ref(soup).cast());
            nearest(geometry, filter as *const c_void);
            any(geometry, filter as *const c_void);
        }
        get("rtcCommitGeometry")?(geometry);
        attach(scene, geometry);
        get("rtcReleaseGeometry")?(geometry);
        get("rtcCommitScene")?(scene);
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        let version = property(device, VERSION);
        Ok(Built {
            cast,
            device,
            scene,
            version,
            build_ms,
            _soup: soup,
            library: ManuallyDrop::new(library),
        })
    }
}

impl Drop for Built<'_> {
    fn drop(&mut self) {
        for (name, object) in [
            ("rtcReleaseScene", self.scene),
            ("rtcReleaseDevice", self.device),
        ] {
            // SAFETY: both were created by this library, and are no longer used.
            unsafe {
                if let Ok(release) = self
                    .library
                    .get::<unsafe extern "C" fn(*mut c_void)>(name.as_bytes())
                {
                    release(object);
                }
            }
        }
    }
}

impl Caster for Built<'_> {
    fn cast(&self, query: Query, ray: &Ray) -> Hit {
        let mut asked = RayHit {
            origin: ray.origin,
            t_near: ray.t_min,
            direction: ray.direction,
            time: 0.0,
            t_far: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: INVALID,
            geometry: INVALID,
            instance: INVALID,
            instance_primitive: INVALID,
        };
        let mut context = Context {
            flags: 0,
            filter: null(),
            instance: [INVALID; 2],
        };
        // SAFETY: the scene is committed, and `RTCRayHit` is valid and begins with an `RTCRay`.
        unsafe {
            match (self.cast, query) {
                (Cast::Three { nearest, .. }, Query::Closest) => {
                    nearest(self.scene, &raw mut context, &raw mut asked)
                }
                (Cast::Three { any, .. }, Query::Any) => {
                    any(self.scene, &raw mut context, &raw mut asked)
                }
                (Cast::Four { nearest, .. }, Query::Closest) => {
                    nearest(self.scene, &raw mut asked, null_mut())
                }
                (Cast::Four { any, .. }, Query::Any) => any(self.scene, &raw mut asked, null_mut()),
            }
        }
        let miss = Hit::miss(ray);
        match query {
            Query::Closest if asked.geometry != INVALID => Hit {
                t: asked.t_far,
                triangle: asked.primitive,
                ..miss
            },
            // An occluded ray ends at minus infinity.
            Query::Any if asked.t_far < 0.0 => Hit {
                triangle: 0,
                ..miss
            },
            _ => Hit {
                triangle: NO_HIT,
                ..miss
            },
        }
    }

    fn version(&self) -> String {
        let [major, minor, patch] = [
            self.version / 10_000,
            self.version / 100 % 100,
            self.version % 100,
        ];
        format!("Embree {major}.{minor}.{patch}")
    }

    fn build_ms(&self) -> f64 {
        self.build_ms
    }
}
