//! Copies of film rows, from which a truncated dispatch is undone.

use glam::Vec4;

use wgray_image::Region;

/// Film rows that contain a tile: a range of bytes in each list of the film.
pub struct FilmRows {
    list_count: u64,
    list_bytes: u64,
    /// Start and size of the range in bytes.
    start: u64,
    size: u64,
}

impl FilmRows {
    /// Returns the rows of a film of a region, stored in a buffer.
    pub fn of(film: &wgpu::Buffer, region: Region, tile: Region) -> FilmRows {
        let row = u64::from(region.width()) * size_of::<Vec4>() as u64;
        let list_bytes = u64::from(region.height()) * row;
        FilmRows {
            list_count: film.size() / list_bytes,
            list_bytes,
            start: u64::from(tile.y0 - region.y0) * row,
            size: u64::from(tile.height()) * row,
        }
    }

    /// Returns the size of a copy in bytes.
    pub fn bytes(&self) -> u64 {
        self.list_count * self.size
    }

    /// Encodes the copy of the rows from the film.
    pub fn save(&self, encoder: &mut wgpu::CommandEncoder, film: &wgpu::Buffer, copy: &wgpu::Buffer) {
        for (film_offset, copy_offset) in self.offsets() {
            encoder.copy_buffer_to_buffer(film, film_offset, copy, copy_offset, self.size);
        }
    }

    /// Encodes the copy of the rows back to the film.
    pub fn restore(&self, encoder: &mut wgpu::CommandEncoder, copy: &wgpu::Buffer, film: &wgpu::Buffer) {
        for (film_offset, copy_offset) in self.offsets() {
            encoder.copy_buffer_to_buffer(copy, copy_offset, film, film_offset, self.size);
        }
    }

    /// Returns the offset of the rows of each list, in the film and in a copy.
    fn offsets(&self) -> impl Iterator<Item = (u64, u64)> {
        (0..self.list_count).map(|i| (i * self.list_bytes + self.start, i * self.size))
    }
}
