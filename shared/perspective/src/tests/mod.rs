mod equivariance;
mod minds;
mod nesting;
mod occlusion;
mod timeline;
mod workspace;
