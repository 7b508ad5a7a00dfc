//! Reuse of pyramids that are no longer referenced.

use std::sync::Arc;

use image::GrayImage;

use super::pyramid::Pyramid;

/// Pyramids in use and free ones.
#[derive(Default)]
pub(crate) struct PyramidPool {
    handed_out: Vec<Arc<Pyramid>>,
}

/// Pyramids kept at most: twice what the road tracker references. It bounds memory and changes no result.
const MOST: usize = 32;

impl PyramidPool {
    /// [`Pyramid::new`], in the memory of one without other references.
    pub(crate) fn pyramid(&mut self, image: &GrayImage, levels: usize) -> Arc<Pyramid> {
        for kept in &mut self.handed_out {
            if let Some(free) = Arc::get_mut(kept) {
                free.refill(image, levels);
                return kept.clone();
            }
        }
        let new = Arc::new(Pyramid::new(image, levels));
        if self.handed_out.len() < MOST {
            self.handed_out.push(new.clone());
        }
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn only_unreferenced_pyramids_are_reused() {
        let image = |grey: u8| GrayImage::from_pixel(40, 40, Luma([grey]));
        let mut pool = PyramidPool::default();
        let held = pool.pyramid(&image(10), 1);
        let dropped = Arc::as_ptr(&pool.pyramid(&image(20), 1));
        let next = pool.pyramid(&image(30), 1);
        assert_eq!(Arc::as_ptr(&next), dropped);
        assert_eq!((held.level(0).row(0)[0], next.level(0).row(0)[0]), (10.0, 30.0));
        let many: Vec<_> = (0..100).map(|k| pool.pyramid(&image(k), 1)).collect();
        assert!(many.iter().zip(0u8..).all(|(p, k)| p.level(0).row(0)[0] == f32::from(k)));
        assert_eq!(pool.handed_out.len(), MOST);
    }
}
