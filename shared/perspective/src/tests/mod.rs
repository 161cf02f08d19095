mod equivariance;
mod minds;
mod nesting;
mod occlusion;
mod owners;
mod timeline;
mod unobserved;
mod workspace;
