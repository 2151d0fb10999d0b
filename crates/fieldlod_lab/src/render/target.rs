//! Render targets that are read back.

use std::sync::mpsc::channel;

use glam::UVec2;

use super::RenderError;

/// Alignment of the rows of a copied texture, in bytes.
const ROW_ALIGNMENT: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

/// Format of the depth buffer.
pub(super) const DEPTH_BUFFER: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A render target with four bytes per texel.
#[derive(Debug)]
pub(super) struct Target {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl Target {
    pub(super) fn new(device: &wgpu::Device, size: UVec2, format: wgpu::TextureFormat) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: size.x,
                height: size.y,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { texture, view }
    }

    /// The color attachment of a pass that clears the target.
    pub(super) fn cleared(&self) -> wgpu::RenderPassColorAttachment<'_> {
        wgpu::RenderPassColorAttachment {
            view: &self.view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: wgpu::StoreOp::Store,
            },
        }
    }

    /// The depth attachment of a pass that clears the target.
    pub(super) fn cleared_depth(&self) -> wgpu::RenderPassDepthStencilAttachment<'_> {
        wgpu::RenderPassDepthStencilAttachment {
            view: &self.view,
            depth_ops: Some(wgpu::Operations {
                // Depth is reversed: 0 is at infinity.
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }
    }

    /// Reads the texels, row by row.
    pub(super) fn read<T: bytemuck::Pod>(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<Vec<T>, RenderError> {
        let size = self.texture.size();
        let row_bytes = (size.width * 4).next_multiple_of(ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row_bytes) * u64::from(size.height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
            },
            size,
        );
        queue.submit([encoder.finish()]);
        let (sender, mapped) = channel();
        buffer
            .slice(..)
            .map_async(wgpu::MapMode::Read, move |result| drop(sender.send(result)));
        wait(device)?;
        if let Ok(Err(error)) = mapped.recv() {
            return Err(RenderError::Lost(error.to_string()));
        }
        let bytes = buffer.slice(..).get_mapped_range();
        // The padding of rows is dropped.
        let rows = bytes.chunks_exact(row_bytes as usize);
        let row =
            |row: &[u8]| bytemuck::pod_collect_to_vec::<u8, T>(&row[..size.width as usize * 4]);
        Ok(rows.flat_map(row).collect())
    }
}

/// Waits until all submitted work is done.
fn wait(device: &wgpu::Device) -> Result<(), RenderError> {
    let done = device.poll(wgpu::PollType::wait_indefinitely());
    done.map(|_| ())
        .map_err(|error| RenderError::Lost(error.to_string()))
}
