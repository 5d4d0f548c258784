//! Tables on the device, which grow with what is written to them.

/// A buffer that grows with what is written to it.
#[derive(Debug)]
pub(super) struct Table {
    label: &'static str,
    usage: wgpu::BufferUsages,
    pub buffer: Option<wgpu::Buffer>,
}

impl Table {
    pub fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage, buffer: None }
    }

    /// Makes room for `size` bytes; whether that took a new buffer.
    pub fn reserve(&mut self, device: &wgpu::Device, size: u64) -> bool {
        let enough = self.buffer.as_ref().is_some_and(|b| b.size() >= size);
        if !enough {
            let descriptor =
                wgpu::BufferDescriptor { label: Some(self.label), size, usage: self.usage, mapped_at_creation: false };
            self.buffer = Some(device.create_buffer(&descriptor));
        }
        !enough
    }

    pub fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) -> bool {
        let moved = self.reserve(device, bytes.len() as u64);
        if let Some(buffer) = &self.buffer {
            queue.write_buffer(buffer, 0, bytes);
        }
        moved
    }
}

/// A table that the shader reads as a texture of 32-bit words, row by row; it grows with what is written to it.
#[derive(Debug)]
pub(super) struct Texels {
    label: &'static str,
    format: wgpu::TextureFormat,
    /// Width of the texture, and the number that its height is a multiple of; one that is more than 1 makes layers of it.
    size: [u32; 2],
    texture: Option<wgpu::Texture>,
}

impl Texels {
    pub fn new(label: &'static str, format: wgpu::TextureFormat, size: [u32; 2]) -> Self {
        Self { label, format, size, texture: None }
    }

    /// Writes a whole number of texels; whether that took a new texture.
    pub fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) -> bool {
        let [width, height] = self.size;
        let texel_bytes = self.format.block_copy_size(None).unwrap_or(16);
        let row_bytes = width * texel_bytes;
        let rows = bytes.len().div_ceil(row_bytes as usize).max(1) as u32;
        let size = match height {
            1 => wgpu::Extent3d { width, height: rows, depth_or_array_layers: 1 },
            _ => wgpu::Extent3d { width, height, depth_or_array_layers: rows.div_ceil(height) },
        };
        let holds = |t: &wgpu::Texture| t.height() >= size.height && t.depth_or_array_layers() >= size.depth_or_array_layers;
        let enough = self.texture.as_ref().is_some_and(holds);
        let (label, format) = (self.label, self.format);
        let make = || {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        };
        if !enough {
            self.texture = Some(make());
        }
        let Some(texture) = &self.texture else { return true };
        // Layer by layer whole rows, and the row that is begun.
        let layer_bytes = row_bytes as usize * size.height as usize;
        for (z, layer) in (0..).zip(bytes.chunks(layer_bytes)) {
            let (whole, begun) = layer.split_at(layer.len() - layer.len() % row_bytes as usize);
            let whole_rows = (whole.len() / row_bytes as usize) as u32;
            let parts = [(whole, 0, width, whole_rows), (begun, whole_rows, begun.len() as u32 / texel_bytes, 1)];
            for (bytes, y, width, height) in parts {
                if !bytes.is_empty() {
                    let origin = wgpu::Origin3d { x: 0, y, z };
                    let place = wgpu::TexelCopyTextureInfo { origin, ..texture.as_image_copy() };
                    let layout =
                        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None };
                    queue.write_texture(place, bytes, layout, wgpu::Extent3d { width, height, depth_or_array_layers: 1 });
                }
            }
        }
        !enough
    }

    pub fn view(&self) -> Option<wgpu::TextureView> {
        let layered = self.size[1] > 1;
        let dimension = if layered { wgpu::TextureViewDimension::D2Array } else { wgpu::TextureViewDimension::D2 };
        let descriptor = wgpu::TextureViewDescriptor { dimension: Some(dimension), ..Default::default() };
        self.texture.as_ref().map(|t| t.create_view(&descriptor))
    }
}
