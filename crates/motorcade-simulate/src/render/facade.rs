//! Walls with windows, and roofs.

use super::colour::{Colour, mixed, scaled};
use super::coverage::{cover, cover_periodic};
use super::scene::Fragment;
use super::textures::Textures;
use super::tile::floor;
use crate::hash;
use crate::mesh::Building;

pub(super) fn wall(textures: &Textures, b: &Building, f: &Fragment) -> Colour {
    let [u, v, _] = f.place();
    let print = f.footprint(0, 1);
    let [fu, fv] = print.extent();
    let probe = print.probe();
    let shift = (b.seed % 97) as f32;
    let fine = textures.noise.sample(u + shift, v, &probe, 4.7);
    let coarse = textures.noise.sample(v + shift, u, &probe.swapped(), 31.0);
    let mut tone = 1.0 + 0.12 * fine + 0.14 * coarse;
    if b.brick {
        let row = floor(v / 0.25);
        let stagger = if row as i64 % 2 == 0 { 0.0 } else { 0.25 };
        let seams =
            cover_periodic(v, 0.0, 0.03, 0.25, fv).max(cover_periodic(u + stagger, 0.0, 0.03, 0.5, fu));
        let near = (1.0 - fu.max(fv) / 0.4).clamp(0.0, 1.0);
        let uniform = hash::unit(b.seed, floor((u + stagger) / 0.5) as i64, row as i64) - 0.5;
        tone += near * 0.3 * uniform + 0.25 * seams;
    }
    let mut colour = scaled(b.wall, tone);
    // A darker plinth and a cornice.
    let plinth = cover(v, -9.0, 1.6, fv);
    colour = scaled(colour, 1.0 - 0.28 * plinth);
    let cornice = cover(v, b.height_m - 0.35, b.height_m + 1.0, fv);
    colour = mixed(colour, [0.70, 0.68, 0.64], cornice * 0.7);

    let [pu, pv] = b.pitch_m;
    let [wu, wv] = b.window_m;
    // Rows start above the plinth and leave the top free.
    let rows = cover(v, 1.9, b.height_m - 0.5, fv);
    let up = v - 1.6;
    let (lu, lv) = (0.5 * (pu - wu), 0.5 * (pv - wv));
    let frame = cover_periodic(u, lu - 0.09, lu + wu + 0.09, pu, fu)
        * cover_periodic(up, lv - 0.12, lv + wv + 0.09, pv, fv)
        * rows;
    let pane = cover_periodic(u, lu, lu + wu, pu, fu) * cover_periodic(up, lv, lv + wv, pv, fv) * rows;
    if frame > 0.0 || pane > 0.0 {
        colour = window(b, colour, f, (frame, pane));
    }
    // A door or shop front on the ground floor of every third axis.
    let low = cover(v, -9.0, 2.15, fv);
    if low > 0.0 {
        let door = cover_periodic(u, 1.0, 2.1, 3.0 * pu, fu) * low;
        let doors = [
            [0.30, 0.20, 0.13],
            [0.16, 0.24, 0.20],
            [0.35, 0.34, 0.33],
            [0.20, 0.24, 0.32],
            [0.42, 0.16, 0.13],
        ];
        colour = mixed(colour, scaled(doors[(b.seed % 5) as usize], 1.0 + 0.2 * fine), door);
    }
    colour
}

/// Colour of glass and frame over the wall; `shares` are the shares of the pixel within the frame and within the pane.
fn window(b: &Building, colour: Colour, f: &Fragment, (frame, pane): (f32, f32)) -> Colour {
    let [u, v, _] = f.place();
    let [fu, fv] = f.footprint(0, 1).extent();
    let [pu, pv] = b.pitch_m;
    let up = v - 1.6;
    let bar = cover_periodic(u, 0.5 * pu - 0.04, 0.5 * pu + 0.04, pu, fu);
    let (i, j) = (floor(u / pu) as i64, floor(up / pv) as i64);
    let near = (1.0 - 0.7 * (fu / pu).max(fv / pv)).clamp(0.0, 1.0);
    let uniform = 0.5 + (hash::unit(b.seed ^ 5, i, j) - 0.5) * near;
    let inner = (up / pv).fract();
    let glass = mixed([0.13, 0.15, 0.18], [0.52, 0.57, 0.62], uniform * (0.35 + 0.65 * inner));
    let trim = if b.seed.is_multiple_of(3) { [0.30, 0.24, 0.20] } else { [0.82, 0.82, 0.80] };
    let framed = mixed(colour, trim, (frame - pane).max(0.0));
    mixed(framed, mixed(glass, trim, bar * 0.9), pane)
}

pub(super) fn roof(textures: &Textures, b: &Building, f: &Fragment) -> Colour {
    let [u, v, _] = f.place();
    let print = f.footprint(0, 1);
    let [fu, fv] = print.extent();
    let fine = textures.noise.sample(u, v, &print.probe(), 6.1);
    let rows = cover_periodic(v, 0.0, 0.08, 0.34, fv).max(0.6 * cover_periodic(u, 0.0, 0.05, 0.3, fu));
    scaled(b.roof, 1.0 + 0.25 * fine - 0.35 * rows)
}
