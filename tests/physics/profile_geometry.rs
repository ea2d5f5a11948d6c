//! Do wheel and rail touch where they should?

use railhead::contact::geometry::contact_search::Search;
use railhead::contact::geometry::formats::{self, Format};
use railhead::contact::geometry::profile::{Body, Profile, Reading};
use railhead::contact::geometry::wheel_rail::{Placement, Side, WheelRail};

fn probe(name: &str) -> String {
    std::fs::read_to_string(format!("/work/shared/reference/profiles/{name}")).unwrap()
}

#[test]
fn probe_all() {
    let load = |name: &str, body, format| {
        let c = formats::read(format, &probe(name)).unwrap();
        Profile::new(body, &c.points, Reading { mirror_y: c.mirror_y, mirror_z: c.mirror_z, smoothing: 0.0 }).unwrap()
    };
    let rail = load("MBench_UIC60_v3.prr", Body::Rail, Format::Simpack);
    let ban = load("MBench_UIC60_v3.ban", Body::Rail, Format::Miniprof);
    let wheel = load("MBench_S1002_v3.prw", Body::Wheel, Format::Simpack);
    println!("{:?} {:?} {:?}", rail.warnings, ban.warnings, wheel.warnings);
    println!("{:?} {:?}", rail.range(), ban.range());
    println!("{:?} {:?}", rail.at(30.0), ban.at(30.0));
    let cases: [(&str, f64, f64, f64, [f64; 6], [f64; 3]); 10] = [
        ("y-3", -3.0, 0.0008, 0.0805865144, [-0.603, 756.6775, 0.0248, -0.0129, -3.8551, 0.0248], [0.0047, 9.6777, -0.2849]),
        ("y0_10", 0.0, 0.0, 0.0159619768, [0.0, 751.8722, 0.1252, -0.029, -8.6604, 0.1252], [0.0, 1.8722, -0.0729]),
        ("y0_75", 0.0, 0.0, 0.061133255, [0.0, 750.3957, 0.1715, -0.0348, -10.1368, 0.1715], [0.0, 0.3957, -0.0718]),
        ("y10", 10.0, 0.024, 0.0340716894, [-5.2821, 721.088, 6.5066, -0.7992, -39.4446, 6.5066], [11.6545, -44.3815, 22.7533]),
        ("y1", 1.0, 0.0, 0.0773322094, [0.0, 745.2263, 0.391, -0.0569, -15.3063, 0.391], [0.0, -5.797, 0.1919]),
        ("y2", 2.0, 0.0, 0.0923335866, [0.0, 741.7804, 0.5897, -0.0769, -18.7522, 0.5897], [0.0, -10.2716, 0.4532]),
        ("y4", 4.0, 0.0006, 0.0916856266, [-0.41, 738.5321, 0.8829, -0.1106, -22.0005, 0.8829], [0.0307, -15.5857, 0.9382]),
        ("y5_10", 5.0, 0.012, 0.0274646172, [-7.0014, 727.0988, 3.0005, -0.2903, -33.4337, 3.0005], [1.6621, -28.0337, 3.2555]),
        ("y5_75", 5.0, 0.0, 0.0862441919, [0.0, 731.6829, 1.9442, -0.2132, -28.8496, 1.9442], [0.0, -23.4813, 2.1524]),
        ("y6", 6.0, 0.0144, 0.0275054542, [-7.382, 725.1369, 3.6883, -0.4177, -35.3957, 3.6883], [2.9698, -31.1225, 4.3352]),
    ];
    for (name, y, yaw, approach, r, w) in cases {
        let roll = -(r[1] - y - (750.0 + w[1]) * f64::cos(yaw) - w[0] * f64::sin(yaw)) / (460.0 + w[2]);
        let geometry = WheelRail::new(rail.clone(), wheel.clone(), Placement {
            side: Side::Right, rolling_radius: 460.0, gauge: 1435.0, gauge_height: 14.0, cant: 0.0,
            flange_back_distance: 1360.0, flange_back_position: -70.0, lateral_shift: -y, yaw: -yaw, roll,
        }).unwrap();
        let t = std::time::Instant::now();
        let search = Search::new(&geometry).unwrap();
        let lowering = approach / r[3].cos();
        let gaps = search.gaps(lowering);
        println!("{name} roll {roll:.6e} {:?} touch {}", t.elapsed(), search.touch);
        println!("   want {r:?} {w:?} approach {approach}");
        for gap in gaps.unwrap() {
            let f = gap.frame;
            let least = gap.gap.iter().flatten().copied().fold(f64::INFINITY, f64::min);
            println!("   {:?} angle {:.4} rail {:?} wheel {:?} least {least:.5} x {:?} y {:?} {}", f.origin, f.angle, geometry.on_rail(f.rail), geometry.on_wheel(f.wheel), [gap.x[0], gap.x[64]], [gap.y[0], gap.y[gap.y.len()-1]], gap.y.len());
        }
    }
}
