//! trial
#[cfg(test)]
mod tests {
    use crate::contact::influence::fft::Convolution;
    use crate::contact::monitor::Unwatched;
    use crate::contact::normal::hertz::{Ellipse, Pressing};
    use crate::contact::normal::non_hertzian::gradients::press;
    use crate::contact::normal::prescribed::PressureField;

    #[test]
    fn trial() {
        for (rx, ry) in [(500.0, 300.0), (300.0, 300.0), (460.0, 40.0)] {
        for n in [24usize, 36, 48] {
            let mut worst = [0.0_f64; 4];
            let mut mean = [0.0; 4]; let mut ring = vec![[0.0_f64; 3]; 10];
        for shift in 0..8 {
                let shift = shift as f64 / 8.0;
                let e = 115000.0;
                let hertz = Ellipse::of_radii(rx, ry, Pressing::Force(80000.0), e);
                let w = [1.15 * hertz.a, 1.15 * hertz.b];
                let d = w.map(|w| 2.0 * w / n as f64);
                let at = |i: usize| -w[0] + (i as f64 + 0.5 + shift) * d[0];
                let ay = |i: usize| -w[1] + (i as f64 + 0.5 + 0.7 * shift) * d[1];
                let h: Vec<f64> = (0..n * n)
                    .map(|k| at(k % n).powi(2) / 2.0 / rx + ay(k / n).powi(2) / 2.0 / ry)
                    .collect();
                let mut c = Convolution::new(n, n, d[0], d[1], e);
                let r = press(&mut c, &h, d[0] * d[1], Pressing::Force(80000.0), vec![1.0; n * n], 1e-5, &Unwatched).unwrap();
                let x: Vec<f64> = (0..n).map(at).collect();
                let y: Vec<f64> = (0..n).map(ay).collect();
                {
                    let mut level = vec![99usize; n * n];
                    for k in 0..n * n { if r.pressure[k] <= 0.0 { level[k] = 0; } }
                    for m in 1..10 { for k in 0..n * n { if level[k] == 99 && (level[k-1] == m - 1 || level[k+1] == m - 1 || level[k-n] == m - 1 || level[k+n] == m-1) { level[k] = m; } } }
                    for k in 0..n * n { if level[k] > 0 && level[k] < 10 {
                        let (x, y) = (at(k % n), ay(k / n));
                        let q = (r.pressure[k] / hertz.pressure_max).powi(2);
                        let qe = 1.0 - (x / hertz.a).powi(2) - (y / hertz.b).powi(2);
                        let g = (2.0 * x / hertz.a.powi(2) * d[0]).hypot(2.0 * y / hertz.b.powi(2) * d[1]);
                        let e = (q - qe) / g;
                        let w = &mut ring[level[k]]; w[0] += 1.0; w[1] += e; w[2] += e * e;
                    } }
                }
                let adj = crate::contact::normal::non_hertzian::edges::adjusted(n, &r.pressure);
                let rows: Vec<Vec<f64>> = adj.chunks_exact(n).map(|c| c.to_vec()).collect();
                let (f, _) = PressureField::new(&x, &y, &rows).unwrap();
                let p = f.patches()[0];
                let err = [p.area / (3.14159265358979 * hertz.a * hertz.b) - 1.0, (p.extent[1] - p.extent[0]) / 2.0 / hertz.a - 1.0, (p.extent[3] - p.extent[2]) / 2.0 / hertz.b - 1.0, r.approach / hertz.approach - 1.0];
                for k in 0..4 { worst[k] = worst[k].max(err[k].abs()); mean[k] += err[k] / 8.0; }
            }
            for m in 1..7 { let w = ring[m]; let mu = w[1] / w[0]; print!(" {m}: {:+.4}±{:.4}", mu, (w[2] / w[0] - mu * mu).sqrt()); }
            println!();
            println!("{rx} {ry} n {n} worst area {:.4} a {:.4} b {:.4} approach {:.5} mean {:.4} {:.4} {:.4} {:.5}", worst[0], worst[1], worst[2], worst[3], mean[0], mean[1], mean[2], mean[3]);
        }
        }
    }
}
