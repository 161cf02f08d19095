mod equivariance;
mod occlusion;
mod timeline;
mod workspace;
