use raystone::accel::*; use raystone::accel::triangle::*; use raystone::config::*; use raystone::gpu::*; use glam::Vec3;
fn main() {
    let (nu, nv) = (316usize, 158usize);
    let p = |i: usize, j: usize| { let th = std::f32::consts::PI * j as f32 / nv as f32; let ph = 2.0*std::f32::consts::PI * (i % nu) as f32 / nu as f32;
        let r = 1.0 + 0.1*(5.0*ph).sin()*(4.0*th).sin() + 0.05*(13.0*ph+3.0*th).sin()*th.sin();
        Vec3::new(r*th.sin()*ph.cos(), r*th.cos(), r*th.sin()*ph.sin()) };
    let mut recs = vec![];
    for j in 0..nv { for i in 0..nu { 
        let (a,b,c,d)=(p(i,j),p(i+1,j),p(i+1,j+1),p(i,j+1));
        for t in [[a,b,c],[a,c,d]] { let id = recs.len() as u32; recs.push(TriangleRecord::new(&raystone::scene::Triangle{vertices:t}, id, 0)); } } }
    let soup = TriangleSoup { records: recs };
    println!("{} tris", soup.records.len());
    let n = 512usize; let mut rays = vec![];
    let eye = Vec3::new(0.0, 0.8, 3.0); let f = (-eye).normalize(); let r = f.cross(Vec3::Y).normalize(); let u = r.cross(f);
    for ty in 0..n/8 { for tx in 0..n/8 { for y in 0..8 { for x in 0..8 {
        let px = ((tx*8+x) as f32 + 0.5)/n as f32*2.0-1.0; let py = 1.0-((ty*8+y) as f32 + 0.5)/n as f32*2.0;
        let d = (f + r*px*0.45 + u*py*0.45).normalize();
        rays.push(Ray{origin: eye.to_array(), t_min:0.0, direction: d.to_array(), t_max: 1e30}); }}}}
    let mut lib = KernelLibrary::default();
    if let Ok(d) = std::env::var("K") { lib = lib.with_folder(std::path::Path::new(&d)).unwrap(); }
    let gpu = open(&AdapterChoice::Best, lib).unwrap();
    println!("{} {} {:?}", gpu.info.name, gpu.info.driver_info, probe_arithmetic(&gpu).unwrap());
    let mut params = Params::default();
    for e in AccelRegistry::default().entries() { for p in e.schema { params.0.insert(p.name.into(), p.default); } }
    if let Ok(l) = std::env::var("LEAF") { params.0.insert("leaf_size".into(), ParamValue::Integer(l.parse().unwrap())); }
    let mut log = BuildLog::default();
    let judge = BvhTwin::build(&soup, &params, &mut log).unwrap();
    println!("build {:?} {:?}", log, judge.stats()); judge.validate(&soup).unwrap();
    // bounce set
    let mut bounce = vec![]; let mut s = 1u32; let mut rnd = || { s = s.wrapping_mul(747796405).wrapping_add(2891336453); (s >> 8) as f32 / 16777216.0 };
    let t0 = std::time::Instant::now();
    let truth: Vec<Hit> = rays.iter().map(|r| judge.closest_hit(r, &mut Counters::default())).collect();
    println!("cpu twin 1T {:.2} Mrays/s", rays.len() as f64/t0.elapsed().as_secs_f64()/1e6);
    while bounce.len() < rays.len() { for (r,h) in rays.iter().zip(&truth) { if h.triangle != NO_HIT && bounce.len() < rays.len() {
        let rec = &soup.records[h.triangle as usize]; let nn = -Vec3::from(rec.e1).cross(Vec3::from(rec.e2)).normalize();
        let nn = if nn.dot(Vec3::from(r.direction))>0.0 {-nn} else {nn};
        let o = Vec3::from(r.origin)+Vec3::from(r.direction)*h.t + nn*1e-4;
        let d = loop { let v = Vec3::new(rnd()*2.0-1.0,rnd()*2.0-1.0,rnd()*2.0-1.0); if v.length_squared()<1.0 { break v.normalize(); } };
        let d = (nn + d).normalize();
        bounce.push(Ray{origin:o.to_array(), t_min:0.0, direction:d.to_array(), t_max:1e30}); } } }
    let only = std::env::var("ONLY").ok();
    for (cname, rays) in [("primary", &rays), ("bounce", &bounce)] {
    let truth: Vec<Hit> = rays.iter().map(|r| judge.closest_hit(r, &mut Counters::default())).collect();
    for kind in AccelRegistry::default().iter() {
        if kind.name() == "brute-force" || only.as_ref().is_some_and(|o| o != kind.name()) { continue; }
        let mut log = BuildLog::default();
        let built = kind.build(&soup, &params, &mut log).unwrap();
        built.validate(&soup).unwrap();
        let b = built.buffers();
        let mut bind = Bindings::new();
        for a in &b.arrays { bind.buffer(a.name, &gpu.storage(a.name, &a.words).unwrap()); }
        for (n, u) in &b.uniforms { bind.uniform(n, u.clone()); }
        bind.buffer("triangles", &gpu.storage("triangles", &soup.records).unwrap());
        bind.buffer("rays", &gpu.storage("rays", rays).unwrap());
        let hits = gpu.zeroed("hits", rays.len() as u64*16).unwrap(); let st = gpu.zeroed("status", 16).unwrap();
        bind.buffer("hits", &hits); bind.buffer("status", &st);
        bind.uniform("batch", UniformValues::new().u32("first",0).u32("count", rays.len() as u32));
        for checks in [true, false] {
        let mut c = Composition::new("integrator/trace_rays").with("accel", kind.kernel());
        for (n,v) in &b.constants { c = c.constant(n,*v); }
        let pl = gpu.pipeline(&c, checks).unwrap();
        let mut best = 1e9f64; for _ in 0..8 { let e = gpu.run(&Dispatch{pipeline:&pl, bindings:&bind, groups: groups_for(rays.len() as u32)}).unwrap(); best = best.min(e.ms()); }
        let got: Vec<Hit> = gpu.read(&hits).unwrap(); let err: Vec<u32> = gpu.read(&st).unwrap();
        let diff = got.iter().zip(&truth).filter(|(a,b)| !a.same_bits(b)).count();
        println!("{cname:8} {:14} checks={checks} build {:.1} ms  {:.2} Mrays/s  differ {diff} status {} hit {}", kind.name(), log.total_ms(), rays.len() as f64/best/1e3, err[0], truth.iter().filter(|h|h.triangle!=NO_HIT).count());
        }
    } }
}
